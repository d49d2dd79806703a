/* A pitch, a ball, a robot and its eyes, just true enough to close the loop around the program of
 * the base: kinematics in the plane, and vision reports made from the true geometry with noise.
 *
 * It knows nothing of the twin: other code, other random numbers, no pictures. Millimetres, radians
 * and seconds in floating point. Everything follows from the seed. */
#ifndef IMAGINED_PITCH_H
#define IMAGINED_PITCH_H

#include <stdint.h>

#include "app/base.h"
#include "app/robot.h"
#include "link/report.h"

#define PITCH_REPORTS_UNDER_WAY 8
#define PITCH_CONSOLE_SIZE      32768

/* Black: nothing in the picture. Blind to ball: painted pink. Dead: no reports. Frozen: the same
 * report again and again. Damaged: one bit of each report is wrong. */
typedef enum {
    EYES_OPEN,
    EYES_BLACK,
    EYES_BLIND_TO_BALL,
    EYES_DEAD,
    EYES_FROZEN,
    EYES_DAMAGED
} pitch_eyes_t;

typedef struct {
    double due_s; /* when the attention interrupt comes */
    report_t report;
} pitch_report_t;

typedef struct {
    pitch_eyes_t eyes;
    double noise; /* 0 = exact, 1 = as a good eye, more = worse */
    int has_opponent;

    double time_s;
    double x, y, heading; /* robot's middle */
    double wheel_mm_s[2];
    double travel_mm[2];
    int16_t duty[2];
    double ball_x, ball_y, ball_vx, ball_vy;
    double opponent_x, opponent_y;
    int goals_for, goals_against;
    double touching_opponent_s;

    uint32_t random;
    uint8_t sequence;
    double next_frame_s;
    pitch_report_t under_way[PITCH_REPORTS_UNDER_WAY];
    unsigned under_way_count;

    char start_line[32];
    const char *typed;                /* what the console still has to hand out */
    char printed[PITCH_CONSOLE_SIZE]; /* what the robot wrote, NUL-terminated */
    unsigned printed_count;
    uint8_t leds;
    uint8_t stop_matched;
    int stop_word;
    adc_readings_t sensors;
    uint8_t extension[64];
    const crash_record_t *crash; /* as of the start before */
    uint32_t baud;               /* as the program asked for, 0 = it did not */
    int restarted;               /* 1 + base_restart_t */

    base_t base;
    robot_t robot;
} pitch_t;

/* Draw a kick-off from `seed`: robot anywhere in its own half with any heading, ball and opponent
 * anywhere. The robot's program is started and waits. */
void pitch_begin(pitch_t *pitch, uint32_t seed, pitch_eyes_t eyes, double noise);

/* Type a line to the robot's console; the string must live until it is read. */
void pitch_type(pitch_t *pitch, const char *line);

/* Let `seconds` pass. */
void pitch_run(pitch_t *pitch, double seconds);

/* `start` with the true heading, then play until a goal or for `seconds`. Returns the time it took.
 */
double pitch_play(pitch_t *pitch, double seconds);

#endif
