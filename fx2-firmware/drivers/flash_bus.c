#include "drivers/flash_bus.h"

#include "board/turret.h"
#include "drivers/fx2_regs.h"
#include "drivers/gpif.h"

__sbit __at(0x80 + TURRET_PA_FLASH_CE) FLASH_CE_N;

uint16_t flash_at_block;
uint16_t flash_at_offset;

static void set_address(void)
{
    uint16_t block = flash_at_block + (uint8_t)((uint8_t)(flash_at_offset >> 8) >> 1);

    IOD = (uint8_t)block;
    IOE = (uint8_t)(block >> 8);
    gpif_set_offset(flash_at_offset & (TURRET_FLASH_BLOCK - 1u));
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

void flash_bus_read(XDATA uint8_t *data, uint8_t length)
{
    set_address();
    gpif_read(data, length);
}

void flash_bus_write(uint8_t value)
{
    set_address();
    gpif_write(value);
}

void flash_bus_command(uint16_t offset, uint8_t value)
{
    IOD = (uint8_t)(offset >> 8) >> 1;
    IOE = 0;
    gpif_set_offset(offset & (TURRET_FLASH_BLOCK - 1u));
    gpif_write(value);
}

uint8_t flash_bus_ready(void)
{
    return gpif_ready_pins() & (1u << TURRET_RDY_FLASH);
}
