/* The turret bus: fetches the vision turret's report, writes its registers.
 *
 * The turret pulls its attention line (level-sensitive IRQ4) low; the interrupt starts one run of
 * the QSPI queue (16 words of 16 bits, 2.1 MHz, 0.13 ms), whose end hands the report over. While
 * a run is on, or if the line stays low after it, the line's interrupt is off: turret_poll() turns
 * it on again, so a stuck line costs one run a tick and no more. */
#ifndef DRIVERS_TURRET_H
#define DRIVERS_TURRET_H

#include <stdint.h>

#define TURRET_REPORT_BYTES 32u

/* Set the attention interrupt up. Call once, after qspi_init(), interrupts still masked. */
void turret_init(void);

/* Once a tick: watches a line that stays low. `gave_up`: its run did not end. */
void turret_poll(int gave_up);

/* If a report arrived since the last call: copies it, sets *age_fine to the time since its
 * attention interrupt (tick_fine() units) and returns 1; else 0. Newest wins. */
int turret_take(uint8_t wire[TURRET_REPORT_BYTES], uint16_t *age_fine);

/* Write a register of the turret with the next report's run. 0 if one still waits. */
int turret_write(uint8_t address, uint16_t value);

/* Reports that were overwritten before anybody took them, and runs given up; both saturate. */
uint16_t turret_overruns(void);
uint16_t turret_timeouts(void);

#endif
