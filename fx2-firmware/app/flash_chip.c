#include "app/flash_chip.h"

#include "drivers/clock.h"
#include "drivers/flash_bus.h"

enum {
    CFI_QUERY_AT = 2 * 0x55,
    COMMAND_CFI_QUERY = 0x98,
    COMMAND_RESET = 0xF0, /* back to reading the array */
    COMMAND_ERASE = 0x80,
    COMMAND_SECTOR = 0x30,
    COMMAND_BUFFER = 0x25,
    COMMAND_CONFIRM = 0x29,
    UNLOCK_1_AT = 0xAAA,
    UNLOCK_1 = 0xAA,
    UNLOCK_2_AT = 0x555,
    UNLOCK_2 = 0x55
};

#define PROGRAM_TICKS CLOCK_TICKS(FLASH_PROGRAM_MS * 1000ul)

/* Where the right chip answers what: pairs of address and value. With eight data lines each CFI
 * word is at twice its address. */
/* clang-format off */
static const CODE uint8_t expected[] = {
    2 * 0x10, 'Q',
    2 * 0x11, 'R',
    2 * 0x12, 'Y',
    2 * 0x13, 0x02, /* primary command set: AMD */
    2 * 0x14, 0x00,
    2 * 0x27, 24    /* 2^24 bytes = FLASH_SIZE */
};
/* clang-format on */

XDATA AT(0xE780) uint8_t flash_page[FLASH_PAGE];

static void unlock(void)
{
    flash_bus_command(UNLOCK_1_AT, UNLOCK_1);
    flash_bus_command(UNLOCK_2_AT, UNLOCK_2);
}

/* Also out of an aborted write to the buffer, which wants to be unlocked first. */
static void reset(void)
{
    unlock();
    flash_bus_write(COMMAND_RESET);
}

uint8_t flash_chip_identify(void)
{
    uint8_t i;

    /* A reset of the FX2 alone may have left the chip in any mode: the first may only be the wrong
     * end of a write to the buffer. */
    reset();
    reset();
    flash_bus_command(CFI_QUERY_AT, COMMAND_CFI_QUERY);
    flash_at_block = 0;
    for (i = 0; i != sizeof expected; i += 2) {
        flash_at_offset = expected[i];
        flash_bus_read(flash_page, 1);
        if (flash_page[0] != expected[i + 1])
            break;
    }
    reset();
    return i == sizeof expected;
}

void flash_chip_erase(void)
{
    unlock();
    flash_bus_command(UNLOCK_1_AT, COMMAND_ERASE);
    unlock();
    flash_bus_write(COMMAND_SECTOR);
}

uint8_t flash_chip_erased(void)
{
    uint8_t i = 0;

    flash_bus_read(flash_page, FLASH_PAGE);
    do {
        if (flash_page[i] != 0xFF) {
            reset();
            return 0;
        }
    } while (++i != FLASH_PAGE);
    return 1;
}

ONCE uint8_t await_ready(void)
{
    clock_start_wait();
    while (!flash_bus_ready()) {
        if (clock_waited(PROGRAM_TICKS))
            return 0;
    }
    return 1;
}

/* Variables that outlive a call are cheaper here than on the 8051's stack. */
static const XDATA uint8_t *source;
static uint8_t size;
static uint8_t left;
static uint16_t begin;

ONCE void fill_buffer(void)
{
    flash_bus_write(COMMAND_BUFFER);
    flash_bus_write((uint8_t)(size - 1u));
    begin = flash_at_offset;
    left = size;
    do {
        flash_bus_write(*source++);
        flash_at_offset++;
    } while (--left);
    flash_at_offset = begin;
    flash_bus_write(COMMAND_CONFIRM);
}

uint8_t flash_chip_program(const XDATA uint8_t *data, uint8_t length)
{
    source = data;
    size = length;
    unlock();
    fill_buffer();
    if (!await_ready())
        return STORE_TIMEOUT;
    flash_bus_read(flash_page, size);
    flash_at_offset += size;
    do {
        size--;
        source--;
        if (flash_page[size] != *source) {
            reset();
            return STORE_PROGRAM_FAILED;
        }
    } while (size);
    return STORE_OK;
}
