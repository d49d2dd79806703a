/* A flash chip of AMD's command set in memory, for tests: as big as the base's, and it can fail. */
#ifndef FAKES_FAKE_FLASH_H
#define FAKES_FAKE_FLASH_H

#include <stdint.h>

#include "board/khepera.h"
#include "drivers/flash.h"

typedef struct {
    uint8_t cells[BOARD_FLASH_SIZE];
    unsigned sequence;     /* how much of a command has come */
    unsigned busy;         /* reads until it is done */
    uint32_t address;      /* of the operation */
    uint16_t data;         /* that it shall become */
    int erasing;           /* the operation is an erase of the sector at `address` */
    int sticks;            /* operations never end: status with DQ5 */
    unsigned operations;   /* begun so far */
    unsigned stray_writes; /* that were no command */
} fake_flash_t;

/* Erased. */
void fake_flash_init(fake_flash_t *chip);
flash_bus_t fake_flash_bus(fake_flash_t *chip);

#endif
