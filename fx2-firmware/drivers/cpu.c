#include "drivers/cpu.h"

#include "drivers/fx2_regs.h"

void cpu_allow_interrupts(void)
{
    EA = 1;
}

void cpu_hold_interrupts(void)
{
    EA = 0;
}

void cpu_sleep(void)
{
    /* The 8051 takes no interrupt directly after a write to IE: the next instruction, which stops
     * the CPU, is executed first, and the interrupt then wakes it. */
    EA = 1;
    PCON |= PCON_IDLE;
}
