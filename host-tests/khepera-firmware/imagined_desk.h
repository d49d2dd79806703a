/* A robot on a desk: its program on a base that has wheels and a serial line and nothing else.
 * Quick enough for a million lines. */
#ifndef IMAGINED_DESK_H
#define IMAGINED_DESK_H

#include <stdint.h>

#include "app/base.h"
#include "app/robot.h"
#include "link/registers.h"

#define DESK_PRINTED_SIZE 65536u

typedef struct {
    const uint8_t *input; /* what the line still has to hand out */
    uint32_t input_left;
    char printed[DESK_PRINTED_SIZE]; /* what the robot wrote, NUL-terminated */
    uint32_t printed_count;
    uint32_t room; /* that the transmit queue has; counts down if it is not UINT32_MAX */
    int16_t duty[2];
    double speed[2]; /* counts in 10 ms */
    double travel[2];
    int32_t counts[2];
    uint8_t leds;
    uint8_t stop_matched;
    int stop_word;
    adc_readings_t sensors;
    uint8_t extension[64];
    uint16_t registers[FPGA_REG_COUNT]; /* of the turret's FPGA */
    uint8_t register_address;           /* the one asked for last */
    int turret_gone;                    /* it does not answer */
    uint8_t report[REPORT_SIZE];
    int report_ready;
    uint16_t fine;
    uint32_t baud;
    int restarted; /* 1 + base_restart_t */
    const crash_record_t *crash;
    base_t base;
    robot_t robot;
} desk_t;

void desk_begin(desk_t *desk);

/* Hand characters in and let the program take them all, without time passing. */
void desk_feed(desk_t *desk, const void *characters, uint32_t count);

/* Ten milliseconds, `count` times; the wheels follow their duty with a lag of 50 ms. */
void desk_ticks(desk_t *desk, unsigned count);

/* Type a line, with its end; what the robot answers to it. */
const char *desk_ask(desk_t *desk, const char *line);

/* A vision report comes. */
void desk_show(desk_t *desk, const report_t *report);

#endif
