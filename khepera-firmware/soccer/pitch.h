/* The pitch, mm (FIRA KheperaSot rules), in field coordinates (soccer/odometry.h). */
#ifndef SOCCER_PITCH_H
#define SOCCER_PITCH_H

#include <stdint.h>

#define PITCH_HALF_LENGTH_MM 525
#define PITCH_HALF_WIDTH_MM  340
#define PITCH_CORNER_MM      50 /* cut off each corner, along either wall */
#define GOAL_HALF_WIDTH_MM   150
#define GOAL_DEPTH_MM        70

/* Is a point on the pitch, or not more than `slack_mm` beyond its walls? */
static inline int pitch_contains(int32_t x_q4, int32_t y_q4, int32_t slack_mm)
{
    int32_t limit_x_q4 = (PITCH_HALF_LENGTH_MM + slack_mm) * 16;
    int32_t limit_y_q4 = (PITCH_HALF_WIDTH_MM + slack_mm) * 16;

    return x_q4 < limit_x_q4 && x_q4 > -limit_x_q4 && y_q4 < limit_y_q4 && y_q4 > -limit_y_q4;
}

#endif
