/* The turret's flash: who is there? (CFI, JEDEC JESD68)
 *
 * Expected is a 128 Mbit chip with the AMD command set at eight data lines, as the M29W128FH. */
#ifndef APP_FLASH_CHIP_H
#define APP_FLASH_CHIP_H

#include <stdint.h>

typedef enum {
    FLASH_OK = 0,
    FLASH_ABSENT = -1, /* no answer to the CFI query */
    FLASH_WRONG = -2   /* another size or command set than the board is made for */
} flash_error_t;

/* Ask the chip, and leave it reading its array. The flash is selected and ready. */
flash_error_t flash_chip_identify(void);

#endif
