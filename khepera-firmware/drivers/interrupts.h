/* What interrupts leave for the main loop. */
#ifndef DRIVERS_INTERRUPTS_H
#define DRIVERS_INTERRUPTS_H

#include <stdint.h>

/* Set by every interrupt that leaves work for the main loop (a tick, a report, a character);
 * cleared by the main loop before it looks for that work. Encoder edges leave none. */
extern volatile uint8_t interrupts_work;

#endif
