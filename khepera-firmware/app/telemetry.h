/* Variables that `stream` sends again and again: names, units, values. */
#ifndef APP_TELEMETRY_H
#define APP_TELEMETRY_H

#include <stdint.h>

#define TELEMETRY_VARIABLES_MAX 16u
#define TELEMETRY_HZ_MAX        100u

typedef struct {
    uint8_t variable[TELEMETRY_VARIABLES_MAX];
    uint8_t count; /* 0 = nothing is streamed */
    uint16_t period_ticks;
    uint16_t wait_ticks; /* until the next line */
    uint32_t dropped;    /* lines for which the console had no room */
} telemetry_t;

struct robot;

/* Number `index` from 0 on: its name, with the unit as suffix, and what it is; NULL after the last
 * one. */
const char *telemetry_name(unsigned index);
const char *telemetry_text(unsigned index);
int32_t telemetry_value(const struct robot *robot, unsigned index);

/* Longest line of the present selection, bytes. */
uint32_t telemetry_line_size(const telemetry_t *telemetry);

#endif
