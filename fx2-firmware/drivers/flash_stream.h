/* The stream from the flash into the FPGA: each byte goes from one to the other in flight, clocked
 * by the GPIF at 5 periods of IFCLK (104 ns). The CPU only turns from one block of 512 bytes to the
 * next.
 *
 * The caller has selected the flash (drivers/flash_bus.h) and the FPGA (drivers/fpga_port.h), and
 * uses neither for anything else between begin and end. Nothing here may be called from an
 * interrupt. */
#ifndef DRIVERS_FLASH_STREAM_H
#define DRIVERS_FLASH_STREAM_H

#include <stdint.h>

/* Begin with block `block` (0..7FFF). The flash drives the bus from now on. */
void flash_stream_begin(uint16_t block);
void flash_stream_end(void);

/* Stream the next `count` blocks (1..255) and wait until they are over: 57 us each. Returns 1, or 0
 * if a block did not end within twice its time; the GPIF is then stopped. */
uint8_t flash_stream_blocks(uint8_t count);

#endif
