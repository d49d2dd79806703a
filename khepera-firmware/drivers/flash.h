/* The base's flash: AMD's command set, 16 bits wide (Am29F400B data sheet: command definitions,
 * write operation status). Sectors are those of board/khepera.h.
 *
 * While the chip programs or erases, it cannot be read: it answers with its status. The program
 * runs from RAM, so it goes on meanwhile; it must not look at the flash. A reset or a loss of
 * supply leaves the word or the sector under way with anything in it: keep a check sum of what
 * matters, and write the word that makes it valid last. */
#ifndef DRIVERS_FLASH_H
#define DRIVERS_FLASH_H

#include <stdint.h>

/* How the chip is reached: 16-bit bus cycles at even addresses. */
typedef struct {
    void *context; /* handed to both */
    uint16_t (*read)(void *context, uint32_t address);
    void (*write)(void *context, uint32_t address, uint16_t value);
} flash_bus_t;

typedef enum {
    FLASH_OK = 0,
    FLASH_BUSY = 1,
    FLASH_FAILED =
        -1 /* the chip gave up, is not there, protects the sector, or had not been erased */
} flash_error_t;

/* The longest that an erase may take: give up after that (data sheet: 1 s typical, 8 s at most). */
#define FLASH_ERASE_MAX_MS 8000u

/* Program one word and wait for it, 12 us typical, 500 us at most. Bits can only be cleared. A word
 * that is there already costs one read. Not from an interrupt. */
flash_error_t flash_program(const flash_bus_t *bus, uint32_t address, uint16_t word);

/* Tell the chip to erase the sector with this address in it: about a second. Then ask with
 * flash_erase_poll() until it does not say FLASH_BUSY. */
void flash_erase_begin(const flash_bus_t *bus, uint32_t address);

/* FLASH_BUSY, FLASH_OK, or FLASH_FAILED, after which the chip can be read again. `address`: as
 * given to flash_erase_begin(). */
flash_error_t flash_erase_poll(const flash_bus_t *bus, uint32_t address);

/* Give an erase up that takes too long. */
void flash_reset(const flash_bus_t *bus);

/* The chip on the board (drivers/flash_board.c). */
extern const flash_bus_t flash_board_bus;

#endif
