#include "drivers/flash.h"

/* Commands, and the addresses they want: word addresses 555 and 2AA. */
#define UNLOCK_1_AT 0xAAAu
#define UNLOCK_2_AT 0x554u
#define UNLOCK_1    0x00AAu
#define UNLOCK_2    0x0055u
#define PROGRAM     0x00A0u
#define ERASE       0x0080u
#define SECTOR      0x0030u
#define READ_ARRAY  0x00F0u

/* Status while it is busy. */
#define DQ7 0x0080u /* complement of the data's bit */
#define DQ5 0x0020u /* time limit exceeded */

#define ERASED        0xFFFFu
/* A turn of the wait takes 2 us at the very least. */
#define PROGRAM_POLLS 1000u

static void command(const flash_bus_t *bus, uint16_t what)
{
    bus->write(bus->context, UNLOCK_1_AT, UNLOCK_1);
    bus->write(bus->context, UNLOCK_2_AT, UNLOCK_2);
    bus->write(bus->context, UNLOCK_1_AT, what);
}

void flash_reset(const flash_bus_t *bus)
{
    bus->write(bus->context, 0, READ_ARRAY);
}

/* Whether the word at `address` has become `expected`. */
static flash_error_t poll(const flash_bus_t *bus, uint32_t address, uint16_t expected)
{
    uint16_t status = bus->read(bus->context, address);

    if ((status ^ expected) & DQ7) {
        if (!(status & DQ5))
            return FLASH_BUSY;
        /* DQ7 may have changed together with DQ5: look again. */
        status = bus->read(bus->context, address);
        if ((status ^ expected) & DQ7) {
            flash_reset(bus);
            return FLASH_FAILED;
        }
    }
    /* DQ7 may come before the other bits: the second read has them all. */
    return bus->read(bus->context, address) == expected ? FLASH_OK : FLASH_FAILED;
}

flash_error_t flash_program(const flash_bus_t *bus, uint32_t address, uint16_t word)
{
    uint16_t there = bus->read(bus->context, address);
    uint16_t turns;

    if (there == word)
        return FLASH_OK;
    if ((there & word) != word)
        return FLASH_FAILED;
    command(bus, PROGRAM);
    bus->write(bus->context, address, word);
    for (turns = 0; turns < PROGRAM_POLLS; turns++) {
        flash_error_t error = poll(bus, address, word);

        if (error != FLASH_BUSY)
            return error;
    }
    flash_reset(bus);
    return FLASH_FAILED;
}

void flash_erase_begin(const flash_bus_t *bus, uint32_t address)
{
    command(bus, ERASE);
    bus->write(bus->context, UNLOCK_1_AT, UNLOCK_1);
    bus->write(bus->context, UNLOCK_2_AT, UNLOCK_2);
    bus->write(bus->context, address, SECTOR);
}

flash_error_t flash_erase_poll(const flash_bus_t *bus, uint32_t address)
{
    return poll(bus, address, ERASED);
}
