/* Time since the 8051 started, by timer 0 at CLKOUT/12 = 4 MHz. */
#ifndef DRIVERS_CLOCK_H
#define DRIVERS_CLOCK_H

#include "drivers/compiler.h"

#include <stdint.h>

/* Run the CPU at 48 MHz and start counting. Called once, by the start-up hook, before anything else
 * runs: what the CPU did before is some 20 cycles. */
void clock_start(void);

/* Let timer 0's overflow interrupt be taken (once global interrupts are on). */
void clock_enable(void);

/* Microseconds since clock_start(), wraps after 71 minutes: compare times by subtracting them.
 * Not to be called from an interrupt, and not with interrupts off for longer than 16 ms. */
uint32_t clock_us(void);

/* The same time for time-outs, cheap on an 8051: units of 64 us, wraps after 4.2 s. */
uint16_t clock_ticks(void);
#define CLOCK_TICKS(us) ((uint16_t)((us) / 64ul + 1u))

/* Interrupt: the upper 16 bits of the count. */
ISR(clock_overflow_isr, 1);

#endif
