/* The 8051 itself: interrupts and sleep. */
#ifndef DRIVERS_CPU_H
#define DRIVERS_CPU_H

/* Let interrupts be taken; hold them back. */
void cpu_allow_interrupts(void);
void cpu_hold_interrupts(void);

/* Allow interrupts and sleep until one comes. Called with interrupts held, so that one which came
 * after the caller looked for work still ends the sleep. */
void cpu_sleep(void);

#endif
