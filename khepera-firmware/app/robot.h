/* The robot's program: console, safety, motion and soccer, on a base_t.
 *
 * The owner calls robot_tick() at 100 Hz and robot_poll() whenever something may have arrived. The
 * robot stands still until the console says `start HEADING`. */
#ifndef APP_ROBOT_H
#define APP_ROBOT_H

#include <stdint.h>

#include "app/base.h"
#include "app/console.h"
#include "app/motion.h"
#include "soccer/soccer.h"

typedef struct {
    const base_t *base;
    console_t console;
    motion_t motion;
    soccer_tuning_t tuning;
    soccer_t soccer;
    int32_t counts[2]; /* encoders at the last tick */
    uint32_t ticks;    /* since start, 10 ms */
    uint32_t reports;  /* good ones */
    uint16_t bad_reports;
    uint8_t sequence;      /* of the last good report */
    uint16_t silent_ticks; /* since the last good report; saturates */
    uint8_t function;      /* of the last good report: FPGA_FUNCTION_* */
    uint8_t playing;
} robot_t;

/* Without a report for this long the motors stop; ticks of 10 ms. */
#define ROBOT_REPORT_TIMEOUT_TICKS 20
/* ... and after this long the robot turns on the spot, looking for anything. */
#define ROBOT_BLIND_SEARCH_TICKS   100

/* `base` must outlive the robot. Prints the greeting. */
void robot_init(robot_t *robot, const base_t *base);

/* One control period: odometry, safety, decision, wheel control. */
void robot_tick(robot_t *robot);

/* Take what has arrived: console lines, at most one report. A report reaches the motors in here. */
void robot_poll(robot_t *robot);

#endif
