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

/* Units of CLOCK_TICK_US since clock_start(), wraps after 4.2 s: compare times by subtracting them.
 * Not to be called from an interrupt, and not with interrupts off for longer than 16 ms. */
uint16_t clock_ticks(void);
#define CLOCK_TICK_US   64u
#define CLOCK_TICKS(us) ((uint16_t)((us) / CLOCK_TICK_US + 1u))

/* Waiting, one wait at a time: it begins; 1 if it lasts longer than `limit` ticks. */
void clock_start_wait(void);
uint8_t clock_waited(uint16_t limit);

/* Interrupt: the upper half of the count. */
ISR(clock_overflow_isr, 1);

#endif
