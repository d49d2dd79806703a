#include "drivers/clock.h"

#include "drivers/fx2_regs.h"

static volatile uint8_t overflows; /* of timer 0: written by the interrupt only */

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

uint16_t clock_ticks(void)
{
    uint8_t upper;
    uint8_t high;

    do {
        upper = overflows;
        high = TH0;
    } while (upper != overflows);
    return (uint16_t)((uint16_t)upper << 8) | high;
}

static uint16_t wait_begun;

void clock_start_wait(void)
{
    wait_begun = clock_ticks();
}

uint8_t clock_waited(uint16_t limit)
{
    return (uint16_t)(clock_ticks() - wait_begun) > limit;
}
