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

/* Where the flash is read and written: set by the caller, moved by nothing here. */
extern uint16_t flash_at_block;
extern uint16_t flash_at_offset;

/* Drive the address pins and deselect the flash. After gpif_init(). */
void flash_bus_init(void);

/* Select the flash; release it again. All that follows needs it selected. */
void flash_bus_select(void);
void flash_bus_release(void);
/* 1 between the two: port C carries addresses, nobody else may use it. */
uint8_t flash_bus_is_selected(void);

/* Read `length` bytes (1..255). */
void flash_bus_read(XDATA uint8_t *data, uint8_t length);

/* One write cycle: a command or a byte to program. Does not wait until the flash has done it. */
void flash_bus_write(uint8_t value);
/* The same at `offset` from the flash's start. */
void flash_bus_command(uint16_t offset, uint8_t value);

/* RY/BY#: not 0 = ready, 0 = erasing or programming. Without a flash: ready (pull-up). */
uint8_t flash_bus_ready(void);

#endif
