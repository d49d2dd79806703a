#include "drivers/flash.h"

#include "board/khepera.h"

static uint16_t board_read(void *context, uint32_t address)
{
    (void)context;
    return *(const volatile uint16_t *)(BOARD_FLASH_BASE + address);
}

static void board_write(void *context, uint32_t address, uint16_t value)
{
    (void)context;
    *(volatile uint16_t *)(BOARD_FLASH_BASE + address) = value;
}

const flash_bus_t flash_board_bus = {(void *)0, board_read, board_write};
