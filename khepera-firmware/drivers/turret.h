/* The turret bus: fetches the vision turret's report, reads and writes its FPGA's registers.
 *
 * The turret pulls its attention line (level-sensitive IRQ4) low; the interrupt starts one run of
 * the QSPI queue (16 words of 16 bits, 2.1 MHz, 0.13 ms), whose end hands the report over. While
 * a run is on, or if the line stays low after it, the line's interrupt is off: turret_poll() turns
 * it on again, so a stuck line costs one run a tick and no more.
 *
 * A register takes runs of three words of its own, 25 us each, which leave a waiting report where
 * it is. One access at a time. */
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

typedef enum {
    TURRET_REGISTER_BUSY,
    TURRET_REGISTER_READ,  /* here is its value */
    TURRET_REGISTER_FAILED /* nobody answers, or the answer was damaged */
} turret_register_t;

/* Begin to read register `address` (0..7F) of link/registers.h, or, with `value`, to write it and
 * read it back. Not while one is under way. */
void turret_register_begin(uint8_t address, const uint16_t *value);

/* How that goes. On TURRET_REGISTER_READ *value is the register's value, else it is left alone. */
turret_register_t turret_register_state(uint16_t *value);

/* The register's run did not end (qspi_poll()). */
void turret_register_give_up(void);

/* Reports that were overwritten before anybody took them, and runs given up; both saturate. */
uint16_t turret_overruns(void);
uint16_t turret_timeouts(void);

#endif
