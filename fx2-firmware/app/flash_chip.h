/* The turret's flash: who is there, erasing and programming. (CFI, JEDEC JESD68; AMD commands)
 *
 * Expected is a 128 Mbit chip with the AMD command set at eight data lines, as the M29W128FH, with
 * a write buffer of FLASH_PAGE bytes. The flash is selected and ready; addresses are those of
 * drivers/flash_bus.h. */
#ifndef APP_FLASH_CHIP_H
#define APP_FLASH_CHIP_H

#include "drivers/compiler.h"
#include "link/requests.h"

#include <stdint.h>

#define FLASH_PAGE 64u

/* For what is read, by us and by others: the chip's buffer of endpoint 1, which is not used. */
extern XDATA AT(0xE780) uint8_t flash_page[FLASH_PAGE];

/* Ask the chip, and leave it reading its array. 1 if it is the expected one. */
uint8_t flash_chip_identify(void);

/* Begin to erase the sector at the flash's address; over when flash_bus_ready() says so. */
void flash_chip_erase(void);
/* After it: 1 if the first page of the sector reads as erased. */
uint8_t flash_chip_erased(void);

/* Program `length` bytes (1..64) at the flash's address and within its page, read them back, and
 * move the address behind them. Takes up to 0.6 ms, at worst FLASH_PROGRAM_MS. Uses flash_page.
 * Returns STORE_OK, STORE_TIMEOUT or STORE_PROGRAM_FAILED. */
#define FLASH_PROGRAM_MS 20u
uint8_t flash_chip_program(const XDATA uint8_t *data, uint8_t length);

#endif
