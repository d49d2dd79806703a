/* The GPIF: bytes over FD[7:0] between the FX2, the flash and the FPGA, at 48 MHz.
 *
 * Three waveforms, written down with their timing in gpif.c: a flash read and a flash write under
 * the CPU, and the stream, which moves up to TURRET_FLASH_BLOCK bytes from the flash into the FPGA
 * without the CPU. The caller has set the flash's address and the chip selects before.
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

/* Between begin and end the flash drives the bus even while no block is on its way; only
 * gpif_stream_block() may be called. The first block begins at offset 0. */
void gpif_stream_begin(void);
void gpif_stream_end(void);

/* Clock the next `length` bytes (1..512) out of the flash into the FPGA, at 5 periods of IFCLK a
 * byte, and wait until they are over: 53 us for 512. Only the last block may be shorter than 512.
 * Returns 1, or 0 if the GPIF did not end within twice that time; it is then stopped. */
uint8_t gpif_stream_block(uint16_t length);

/* Levels of RDY[5:0]. */
uint8_t gpif_ready_pins(void);

#endif
