/* The seam between the program and the base it runs on.
 *
 * The 68331 fills it with its drivers (app/main.c), tests with an imagined base. Everything above
 * is plain C that knows no register. All functions return at once. */
#ifndef APP_BASE_H
#define APP_BASE_H

#include <stdint.h>

#include "app/parameter_store.h"
#include "board/crash.h"
#include "drivers/adc.h"
#include "drivers/turret.h"
#include "link/report.h"

/* What base_t.fine counts, a second. */
#define BASE_FINE_HZ 98304u

typedef enum { BASE_RESTART, BASE_LOADER } base_restart_t;

typedef struct {
    void *context; /* handed to every function */

    /* Encoder counts since start, 12 per mm, forward positive, wrapping; [0] left, [1] right. */
    void (*encoders)(void *context, int32_t counts[2]);
    /* Duty of both motors, -255..255, forward positive. */
    void (*motors)(void *context, int16_t left, int16_t right);
    /* 1 once for each time the emergency stop's word came in; the motors are off by then. */
    int (*stop_word)(void *context);
    /* The newest report not yet taken: 1 with wire and the time since its attention interrupt
     * (units of 100 us), or 0. */
    int (*report)(void *context, uint8_t wire[REPORT_SIZE], uint16_t *age_100us);
    /* Read a register of the turret's FPGA, or, with `value`, write it and read it back: begins it,
     * and the next one only when the state says that this one is over. */
    void (*register_begin)(void *context, uint8_t address, const uint16_t *value);
    turret_register_t (*register_state)(void *context, uint16_t *value);
    void (*sensors)(void *context, adc_readings_t *readings);
    /* The extension bus, addresses 0..63. */
    uint8_t (*bus_read)(void *context, uint8_t address);
    void (*bus_write)(void *context, uint8_t address, uint8_t value);
    /* Bit 0 = LED 0, bit 1 = LED 1. */
    void (*leds)(void *context, uint8_t leds);

    /* 1 if console_read() would give a character. */
    int (*console_waits)(void *context);
    /* Next character from the console, or -1. */
    int (*console_read)(void *context);
    /* Queue characters to the console; those that the queue does not take are lost. */
    void (*console_write)(void *context, const char *characters, uint16_t count);
    /* Characters that can be queued now. */
    uint32_t (*console_room)(void *context);
    /* 1 if all has been sent. */
    int (*console_sent)(void *context);
    /* Change the baud rate, once all has been sent. */
    void (*console_baud)(void *context, uint32_t baud);

    /* A clock of BASE_FINE_HZ that wraps. */
    uint16_t (*fine)(void *context);
    /* Reset the chip: into this program again, or into the loader. */
    void (*restart)(void *context, base_restart_t how);
    /* NULL if there is none to keep parameters in. */
    const store_flash_t *flash;

    const char *reset_cause;
    const uint8_t *build_id; /* BUILD_ID_BYTES */
    /* The last crash, NULL if there was none, and forgetting it. */
    const crash_record_t *(*crash)(void *context);
    void (*crash_clear)(void *context);
    uint32_t (*stack_used)(void *context); /* bytes, deepest so far */
    uint32_t stack_size;
    uint16_t (*console_lost)(void *context);
    uint16_t (*reports_lost)(void *context);
} base_t;

#endif
