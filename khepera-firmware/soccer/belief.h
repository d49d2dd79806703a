/* What the robot believes, as it leaves the robot: for the console, and for a debugger or the twin
 * that reads it from memory.
 *
 * Every field is an int32_t, so that the layout is the same for every compiler; big-endian in the
 * memory of a 68331. Field coordinates as in soccer/odometry.h. Fields are only ever added at the
 * end. */
#ifndef SOCCER_BELIEF_H
#define SOCCER_BELIEF_H

#include <stdint.h>

#define SOCCER_BELIEF_VERSION 1

typedef struct {
    int32_t version; /* SOCCER_BELIEF_VERSION */
    int32_t state;   /* strategy_state_t */
    int32_t x_q4;    /* the robot's middle, mm, 1/16 */
    int32_t y_q4;
    int32_t heading;   /* 1/65536 turn, -32768..32767 */
    int32_t localised; /* 1 as soon as a goal has told the place */
    int32_t ball_known;
    int32_t ball_x_q4;
    int32_t ball_y_q4;
    int32_t ball_age_ticks; /* since it was last seen, 10 ms */
    int32_t opponent_known;
    int32_t opponent_x_q4;
    int32_t opponent_y_q4;
    int32_t opponent_age_ticks;
    int32_t ticks;         /* since power-on; changes when everything above is true for now */
    int32_t ball_sigma_q4; /* standard deviations of the places as seen from the robot, mm, 1/16 */
    int32_t opponent_sigma_q4;
    int32_t position_var_mm2; /* of x and of y */
} soccer_belief_t;

#endif
