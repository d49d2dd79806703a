#include "drivers/fpga_port.h"

#include "board/turret.h"
#include "drivers/fx2_regs.h"
#include "drivers/gpif.h"

__sbit __at(0x80 + TURRET_PA_PROG) PROG_N;
__sbit __at(0x80 + TURRET_PA_FPGA_CS) FPGA_CS_N;
__sbit __at(0x80 + TURRET_PA_SPI_SS) SPI_SS_N;

void fpga_port_init(void)
{
    PROG_N = 1;
    FPGA_CS_N = 1;
    SPI_SS_N = 1;
    OEA |= (1u << TURRET_PA_PROG) | (1u << TURRET_PA_FPGA_CS) | (1u << TURRET_PA_SPI_SS);
}

void fpga_port_program(uint8_t pull)
{
    PROG_N = !pull;
}

void fpga_port_select(uint8_t selected)
{
    FPGA_CS_N = !selected;
}

uint8_t fpga_port_init_level(void)
{
    return gpif_ready_pins() & (1u << TURRET_RDY_INIT);
}

uint8_t fpga_port_done_level(void)
{
    return gpif_ready_pins() & (1u << TURRET_RDY_DONE);
}
