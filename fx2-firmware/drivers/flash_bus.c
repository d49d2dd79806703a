#include "drivers/flash_bus.h"

#include "board/turret.h"
#include "drivers/fx2_regs.h"
#include "drivers/gpif.h"

__sbit __at(0x80 + TURRET_PA_FLASH_CE) FLASH_CE_N;

static void set_address(uint16_t block, uint16_t offset)
{
    block += (uint8_t)(offset >> 8) / 2u;
    IOD = (uint8_t)block;
    IOE = (uint8_t)(block >> 8);
    gpif_set_offset(offset & (TURRET_FLASH_BLOCK - 1u));
}

void flash_bus_init(void)
{
    FLASH_CE_N = 1;
    OEA |= 1u << TURRET_PA_FLASH_CE;
    OED = 0xFF;
    OEE = 0xFF; /* bit 7 is GPIFADR8 */
}

void flash_bus_select(void)
{
    FLASH_CE_N = 0;
}

void flash_bus_release(void)
{
    FLASH_CE_N = 1;
}

uint8_t flash_bus_is_selected(void)
{
    return !FLASH_CE_N;
}

void flash_bus_read(uint16_t block, uint16_t offset, XDATA uint8_t *data, uint8_t length)
{
    set_address(block, offset);
    gpif_read(data, length);
}

uint8_t flash_bus_erased(uint16_t block, uint16_t offset, uint8_t length)
{
    set_address(block, offset);
    return gpif_read_ones(length);
}

void flash_bus_write(uint16_t block, uint16_t offset, uint8_t value)
{
    set_address(block, offset);
    gpif_write(value);
}

uint8_t flash_bus_ready(void)
{
    return (gpif_ready_pins() >> TURRET_RDY_FLASH) & 1u;
}
