/* The seam between the program and the base it runs on.
 *
 * The 68331 fills it with its drivers (app/main.c), tests with an imagined base. Everything above
 * is plain C that knows no register. All functions return at once. */
#ifndef APP_BASE_H
#define APP_BASE_H

#include <stdint.h>

#include "link/report.h"

typedef struct {
    void *context; /* handed to every function */

    /* Encoder counts since start, 12 per mm, forward positive, wrapping; [0] left, [1] right. */
    void (*encoders)(void *context, int32_t counts[2]);
    /* Duty of both motors, -255..255, forward positive. */
    void (*motors)(void *context, int16_t left, int16_t right);
    /* The newest report not yet taken: 1 with wire and the time since its attention interrupt
     * (units of 100 us), or 0. */
    int (*report)(void *context, uint8_t wire[REPORT_SIZE], uint16_t *age_100us);
    /* Next character from the console, or -1. */
    int (*console_read)(void *context);
    /* Queue one character to the console: 1, or 0 if the queue is full. */
    int (*console_write)(void *context, uint8_t character);
    /* Bit 0 = LED 0, bit 1 = LED 1. */
    void (*leds)(void *context, uint8_t leds);

    /* For `status` only. */
    const char *reset_cause;
    /* Text about the last crash into text[0..size-1], NUL-terminated; 0 if there was none. */
    int (*crash)(void *context, char *text, uint16_t size);
    uint32_t (*stack_used)(void *context); /* bytes, deepest so far */
    uint16_t (*console_lost)(void *context);
    uint16_t (*reports_lost)(void *context);
} base_t;

#endif
