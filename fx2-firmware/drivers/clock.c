#include "drivers/clock.h"

#include "drivers/fx2_regs.h"

static volatile uint16_t overflows; /* of timer 0: written by the interrupt only */

void clock_start(void)
{
    CPUCS = CPUCS_48MHZ;
    /* MOVX in 2 cycles: all memory is on the chip. Timer 0 counts CLKOUT/12. */
    CKCON = 0;
    TMOD = TMOD_T0_16BIT;
    TR0 = 1;
}

void clock_enable(void)
{
    ET0 = 1;
}

ISR(clock_overflow_isr, INTERRUPT_TIMER0)
{
    overflows++;
}

uint32_t clock_us(void)
{
    uint16_t upper;
    uint8_t high;
    uint8_t low;

    /* Read again if the low byte or the whole timer overflowed in between. */
    do {
        upper = overflows;
        high = TH0;
        low = TL0;
    } while (high != TH0 || upper != overflows);
    return (((uint32_t)upper << 16) | ((uint16_t)((uint16_t)high << 8) | low)) >> 2;
}

uint16_t clock_ticks(void)
{
    uint8_t upper;
    uint8_t high;

    do {
        upper = (uint8_t)overflows;
        high = TH0;
    } while (upper != (uint8_t)overflows);
    return (uint16_t)((uint16_t)upper << 8) | high;
}
