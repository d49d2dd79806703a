/* The QSPI, shared: one run of its queue at a time, each for one owner.
 *
 * An owner starts a run from the program or from an interrupt; if another run is on, it is begun as
 * soon as that ends. Its words are handed over in the interrupt at its end. A run that does not end
 * (nobody clocks, a register broke) is given up by qspi_poll(). */
#ifndef DRIVERS_QSPI_H
#define DRIVERS_QSPI_H

#include <stdint.h>

/* In the order of their urgency. */
typedef enum { QSPI_TURRET, QSPI_REGISTER, QSPI_ADC, QSPI_OWNER_COUNT } qspi_owner_t;

typedef struct {
    uint8_t words;         /* 1..16, of 16 bits */
    uint8_t select;        /* chip selects while selected (BOARD_PCS_*) */
    uint8_t keep_selected; /* 1: through the whole run; 0: for each word */
    uint8_t delay_us;      /* after each word; 0 = none */
    uint8_t constant;      /* 1: nothing in here changes after the first run */
    /* Words to send; filled by the owner before each run. */
    uint16_t send[16];
    /* In the interrupt at the run's end. `received` is the QSPI's own memory, so words arrive by
     * being read once; it is valid until this returns. */
    void (*done)(const volatile uint16_t *received);
} qspi_job_t;

/* The module, its interrupts (also the serial line's), no run. Call once, interrupts masked. */
void qspi_init(void);

/* Start the run of an owner. `job` must stay until its end. Asking again before it has begun
 * changes nothing. May be called from an interrupt. */
void qspi_start(qspi_owner_t owner, const qspi_job_t *job);

/* Once a tick: gives up a run that is on for more than a tick. Returns 1 if it did, and the owner.
 */
int qspi_poll(qspi_owner_t *owner);

#endif
