/* The GPIF: bytes over FD[7:0] between the FX2, the flash and the FPGA, at 48 MHz.
 *
 * Four waveforms, written down with their timing in gpif.c: a flash read and a flash write, one
 * byte at a time under the CPU, and the streams into the FPGA from the flash and from USB, which
 * drivers/flash_stream.h and drivers/usb_stream.h use. The caller has set the flash's upper address
 * and the chip selects before.
 *
 * Nothing here may be called from an interrupt. */
#ifndef DRIVERS_GPIF_H
#define DRIVERS_GPIF_H

#include "drivers/compiler.h"

#include <stdint.h>

/* IFCLK, the waveforms and the address pins GPIFADR[8:0]. The flash's OE#, WE# and CCLK rest. */
void gpif_init(void);

/* Address within a flash block, 0..511: pins A[8:0]. */
void gpif_set_offset(uint16_t offset);

/* Read `length` bytes (1..255) from consecutive offsets. */
void gpif_read(XDATA uint8_t *data, uint8_t length);

/* One write cycle to the flash. */
void gpif_write(uint8_t value);

/* Levels of RDY[5:0]. */
uint8_t gpif_ready_pins(void);

#endif
