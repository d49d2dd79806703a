/* Odometry: where the wheels say the robot is.
 *
 * Field coordinates: origin in the pitch's middle, +x towards the opponent's goal, +y left of that;
 * heading 0 along +x, left positive. Pure state, no hardware. */
#ifndef SOCCER_ODOMETRY_H
#define SOCCER_ODOMETRY_H

#include <stdint.h>

#include "soccer/angle.h"

typedef struct {
    int32_t x_q16; /* mm */
    int32_t y_q16;
    uint32_t heading_q32; /* turns: 2^32 = 360 degrees */
} odometry_t;

/* A pose as the rest of the program uses it. */
typedef struct {
    int32_t x_q4; /* mm, 1/16 */
    int32_t y_q4;
    angle_t heading;
} pose_t;

/* Set the pose. |x|, |y| <= 2000 mm. */
void odometry_set(odometry_t *odometry, const pose_t *pose);

/* Add the travel of one control period: encoder counts (12 per mm) of the left and right wheel,
 * |counts| <= 1000. The path is taken as a chord at the mean heading. Position saturates at
 * +-2 m. */
void odometry_add(odometry_t *odometry, int32_t left_counts, int32_t right_counts);

/* The present pose, rounded. */
void odometry_pose(const odometry_t *odometry, pose_t *pose);

#endif
