/* The robot's program: console, safety, motion and soccer, on a base_t.
 *
 * The owner calls robot_tick() at 100 Hz and robot_poll() whenever something may have arrived. The
 * motors stay off until a command turns them on: `start HEADING` of the shell (soccer), or C, D, P
 * of K-Team's protocol. */
#ifndef APP_ROBOT_H
#define APP_ROBOT_H

#include <stdint.h>

#include "app/base.h"
#include "app/format.h"
#include "app/line_editor.h"
#include "app/log.h"
#include "app/motion.h"
#include "app/parameters.h"
#include "app/pose.h"
#include "app/tasks.h"
#include "app/telemetry.h"
#include "soccer/freshness.h"
#include "soccer/soccer.h"

struct robot;

/* Prints line `index` of a list; 0 if there is none, and the list has ended. */
typedef int (*robot_list_t)(struct robot *robot, uint16_t index);

/* Answers a register's access: its value, NULL if the turret did not answer. */
typedef void (*robot_register_t)(struct robot *robot, const uint16_t *value);

typedef struct robot {
    const base_t *base;
    line_terminal_t terminal;
    line_editor_t editor;
    parameters_t parameters;
    parameter_store_t store;
    motion_t motion;
    base_pose_t pose;
    soccer_t soccer;
    log_t log;
    tasks_t tasks;
    telemetry_t telemetry;
    adc_readings_t sensors;
    int32_t counts[2];    /* encoders at the last tick */
    uint16_t travel_fine; /* ... and when they were read */
    uint32_t ticks;       /* since start, 10 ms */
    uint32_t reports;     /* good ones */
    report_t report;      /* the last good one; its version is 0 before the first */
    uint16_t bad_reports;
    uint16_t stale_reports; /* repeated, out of order, held up */
    freshness_t fresh;
    uint16_t silent_ticks; /* since the last good report; saturates */
    uint8_t playing;
    uint8_t emergency; /* `estop` came in: the motors stay off until `estop clear` */
    uint8_t leds;      /* as command L wants them */
    uint8_t leds_shown;
    uint8_t log_live;
    uint8_t saving;    /* `save` answers when it is done; other lines wait */
    robot_list_t list; /* under way, line by line, so that control is not held up; NULL = none */
    uint16_t list_next;
    const char *list_argument;        /* in the line that asked for it */
    robot_register_t register_answer; /* of the access under way, other lines wait; NULL = none */
    uint8_t register_address;         /* ... of which register, */
    uint16_t register_wanted;         /* ... and what was written, if it is a write */
    uint8_t restart;                  /* 1 + base_restart_t: wanted, as soon as all has been sent */
    uint8_t battery_low;
} robot_t;

typedef struct {
    int32_t x_mm, y_mm;
    int32_t heading_deg10;
} robot_pose_t;

/* Without a report for this long the motors stop; ticks of 10 ms. */
#define ROBOT_REPORT_TIMEOUT_TICKS 20
/* ... and after this long the robot turns on the spot, looking for anything. */
#define ROBOT_BLIND_SEARCH_TICKS   100
/* No answer is longer: a line is not obeyed before the console has room for so much. */
#define ROBOT_REPLY_ROOM           2048u
/* Nor is a line of it. */
#define ROBOT_PRINT_MAX            240u

/* `base` must outlive the robot. Loads the saved parameters and prints the greeting. */
void robot_init(robot_t *robot, const base_t *base);

/* One control period: odometry, safety, decision, wheel control. */
void robot_tick(robot_t *robot);

/* Take what has arrived: some console characters, at most one report, a step of a save. A report
 * reaches the motors in here. Returns 1 if there is more to do at once. */
int robot_poll(robot_t *robot);

/* ---- For the console's commands (app/kteam.h, app/shell.h) ---- */

/* At most ROBOT_PRINT_MAX characters at a time. */
void robot_print(const robot_t *robot, const char *format, ...) FORMAT_LIKE_PRINTF(2, 3);

/* Answer with a list: its lines are printed one a poll from now on. */
void robot_list(robot_t *robot, robot_list_t list, const char *argument);

/* Read a register of the turret's FPGA, or write it and read it back: `answer` is called within a
 * few milliseconds. Not while one is under way. */
void robot_register_read(robot_t *robot, uint8_t address, robot_register_t answer);
void robot_register_write(robot_t *robot, uint8_t address, uint16_t value, robot_register_t answer);

/* Play from now on; 0 if an emergency stop is on. */
int robot_play(robot_t *robot, angle_t heading);
/* Motors off, play over. */
void robot_stop(robot_t *robot);
/* Make way for a motion command; 0 if an emergency stop is on. */
int robot_take_over(robot_t *robot);

robot_pose_t robot_pose(const robot_t *robot);
int32_t robot_battery_mv(const robot_t *robot);

/* Duration of a task in microseconds. */
#define TASK_US(fine) ((int32_t)((uint32_t)(fine)*1000u / (BASE_FINE_HZ / 1000u)))

#endif
