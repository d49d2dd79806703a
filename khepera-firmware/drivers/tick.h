/* The 100 Hz tick (periodic interrupt timer), a finer clock (the PWM's counter), and the watchdog.
 *
 * The tick is 82/8192 s = 10.01 ms. The PWM's counter wraps after 10.42 ms, so the tick's interrupt
 * carries it on. */
#ifndef DRIVERS_TICK_H
#define DRIVERS_TICK_H

#include <stdint.h>

/* Start the tick. Call once, after motors_init(), interrupts still masked. */
void tick_init(void);

/* Ticks since the last call, 0 if none; more than 1 means that some were missed. */
uint8_t tick_take(void);

/* A fine clock: TICK_FINE_HZ, wraps after 0.66 s. May be called from an interrupt. */
#define TICK_FINE_HZ 98304u /* system clock / 256 */
uint16_t tick_fine(void);

/* Restart the watchdog's 62.5 ms. Only the control loop may call it, and only when every task has
 * done its share. */
void watchdog_service(void);

/* What caused the last reset: "power", "external", "watchdog", "halt monitor", "loss of clock",
 * "reset instruction" or "unknown". */
const char *reset_cause(void);

#endif
