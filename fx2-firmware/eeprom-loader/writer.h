/* Reading and writing the boot EEPROM (24LC128: two address bytes, pages of 64, 5 ms a write). */
#ifndef EEPROM_LOADER_WRITER_H
#define EEPROM_LOADER_WRITER_H

#include "drivers/compiler.h"

#include <stdint.h>

/* All return LOADER_OK or what is wrong (link/eeprom.h). */

/* Read `length` bytes (1..64) from `address` on into data[]. */
uint8_t writer_read(uint16_t address, XDATA uint8_t *data, uint8_t length);

/* Write data[0..length-1] (1..64 bytes) within one page and read them back. */
uint8_t writer_write(uint16_t address, const XDATA uint8_t *data, uint8_t length);

/* LOADER_OK if the first `length` bytes have the CRC-16 `crc`, byte 0 counted as `first`. 60 us a
 * byte. */
uint8_t writer_check(uint16_t length, uint8_t first, uint16_t crc);

#endif
