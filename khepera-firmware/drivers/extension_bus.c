#include "drivers/extension_bus.h"

#include "board/khepera.h"
#include "board/mc68331.h"

/* Asynchronous, upper byte, reads and writes, address strobe, any space; 2 KiB; the chip ends the
 * cycle itself, so that an empty bus is no bus error. */
#define CSOR_VALUE    (0x5830u | BOARD_EXTENSION_WAIT_STATES << 6)
#define CSBAR_VALUE   (BOARD_EXTENSION_BASE >> 8)
#define CSPAR0_CS3    0x0300u
/* On an 8-bit bus on D15..8, byte n of the bus is at twice the address. */
#define BYTE(address) REG8(BOARD_EXTENSION_BASE + 2u * (address))

void extension_bus_init(void)
{
    CSBAR3 = (uint16_t)CSBAR_VALUE;
    CSOR3 = CSOR_VALUE;
    CSPAR0 |= CSPAR0_CS3;
}

uint8_t extension_bus_read(uint8_t address)
{
    return BYTE(address % EXTENSION_BUS_SIZE);
}

void extension_bus_write(uint8_t address, uint8_t value)
{
    BYTE(address % EXTENSION_BUS_SIZE) = value;
}
