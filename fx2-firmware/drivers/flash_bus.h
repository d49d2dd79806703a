/* The bus to the turret's parallel flash: chip select, address pins, and cycles by the GPIF.
 *
 * An address is a block of TURRET_FLASH_BLOCK (512) bytes, 0..7FFF, and a byte offset from its
 * start: sixteen bits each, which an 8051 can afford. The block is set on port pins, the offset
 * within it the GPIF counts by itself; an offset may lie beyond the block, but no access may cross
 * the end of one. Nothing here may be called from an interrupt. */
#ifndef DRIVERS_FLASH_BUS_H
#define DRIVERS_FLASH_BUS_H

#include "drivers/compiler.h"

#include <stdint.h>

/* Drive the address pins and deselect the flash. After gpif_init(). */
void flash_bus_init(void);

/* Select the flash; release it again. All that follows needs it selected. */
void flash_bus_select(void);
void flash_bus_release(void);

/* 1 while it is selected: port C carries its address then. */
uint8_t flash_bus_is_selected(void);

/* Read `length` bytes (1..255) at `block` and `offset`. */
void flash_bus_read(uint16_t block, uint16_t offset, XDATA uint8_t *data, uint8_t length);

/* 1 if the `length` bytes (1..255) at `block` and `offset` are all FF. Much quicker than reading
 * them: the whole store is searched like this. */
uint8_t flash_bus_erased(uint16_t block, uint16_t offset, uint8_t length);

/* One write cycle: a command or a byte to program. Does not wait until the flash has done it. */
void flash_bus_write(uint16_t block, uint16_t offset, uint8_t value);

/* RY/BY#: 1 = ready, 0 = erasing or programming. Without a flash: 1 (pull-up). */
uint8_t flash_bus_ready(void);

#endif
