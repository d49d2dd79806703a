#include "drivers/spi.h"

#include "board/turret.h"
#include "drivers/fx2_regs.h"
#include "link/registers.h"

__sbit __at(0x80 + TURRET_PA_SPI_SS) SS_N;
__sbit __at(0xA0 + TURRET_PC_SPI_SCK) SCK;
__sbit __at(0xA0 + TURRET_PC_SPI_MOSI) MOSI;
__sbit __at(0xA0 + TURRET_PC_SPI_MISO) MISO;

/* One byte both ways, mode 0: data stand still while SCK is high. */
static uint8_t exchange(uint8_t byte)
{
    uint8_t bits = 8;

    do {
        MOSI = byte >> 7;
        byte <<= 1;
        SCK = 1;
        if (MISO)
            byte |= 1u;
        SCK = 0;
    } while (--bits);
    return byte;
}

static uint16_t transfer(uint8_t first, uint16_t value)
{
    uint8_t high;

    IOC = 0;
    OEC = 1u << TURRET_PC_SPI_SCK | 1u << TURRET_PC_SPI_MOSI;
    PORTCCFG = 0;
    SS_N = 0;
    exchange(first);
    high = exchange((uint8_t)(value >> 8));
    value = (uint16_t)((uint16_t)high << 8) | exchange((uint8_t)value);
    SS_N = 1;
    PORTCCFG = 0xFF; /* addresses again, as gpif_init() left it */
    OEC = 0xFF;
    return value;
}

uint16_t spi_register_read(uint8_t address)
{
    return transfer(address, 0);
}

void spi_register_write(uint8_t address, uint16_t value)
{
    transfer((uint8_t)(address | FPGA_SPI_WRITE), value);
}
