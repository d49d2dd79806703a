/* The stream from endpoint 02 into the FPGA: the GPIF clocks each byte at 2 periods of IFCLK
 * (42 ns) as fast as the host sends them; the CPU has no part in it.
 *
 * Endpoint 02 is open (drivers/usb_bulk.h), the FPGA selected (drivers/fpga_port.h) and the flash
 * not. Nothing here may be called from an interrupt. */
#ifndef DRIVERS_USB_STREAM_H
#define DRIVERS_USB_STREAM_H

#include "drivers/compiler.h"

#include <stdint.h>

/* Clock the next bytes that the host sends into the FPGA: `length` of them, big-endian, 1 .. 2^24 -
 * 1. */
void usb_stream_begin(const XDATA uint8_t length[4]);

/* Bytes that the FPGA has still to take, in units of 256, rounded down. */
uint16_t usb_stream_left_256(void);

/* 1 if the FPGA has taken all. */
uint8_t usb_stream_done(void);

/* 1 if the host has sent more than that. */
uint8_t usb_stream_surplus(void);

/* Stop, and forget what has not been taken. Harmless if nothing streams. */
void usb_stream_end(void);

#endif
