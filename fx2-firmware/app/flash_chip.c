#include "app/flash_chip.h"

#include "drivers/compiler.h"
#include "drivers/flash_bus.h"

enum {
    CFI_QUERY_AT = 2 * 0x55,
    COMMAND_CFI_QUERY = 0x98,
    COMMAND_RESET = 0xF0 /* back to reading the array */
};

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
#define SIGNATURE_END 6u /* who fails before is no CFI flash at all */

static XDATA uint8_t answer;

static flash_error_t compare(void)
{
    uint8_t i;

    for (i = 0; i < sizeof expected; i += 2) {
        flash_bus_read(0, expected[i], &answer, 1);
        if (answer != expected[i + 1])
            return i < SIGNATURE_END ? FLASH_ABSENT : FLASH_WRONG;
    }
    return FLASH_OK;
}

flash_error_t flash_chip_identify(void)
{
    flash_error_t error;

    /* A reset of the FX2 alone may have left the chip in any mode. */
    flash_bus_write(0, 0, COMMAND_RESET);
    flash_bus_write(0, CFI_QUERY_AT, COMMAND_CFI_QUERY);
    error = compare();
    flash_bus_write(0, 0, COMMAND_RESET);
    return error;
}
