/* Where the wheels say the base is since it was last set: dead reckoning without a pitch around it.
 *
 * x forward, y left of the pose at which it was set, heading left positive. Millimetres up to
 * +-8,000 m, then it wraps; the heading wraps at +-180 degrees. */
#ifndef APP_POSE_H
#define APP_POSE_H

#include <stdint.h>

#include "soccer/odometry.h"

typedef struct {
    int32_t x_q8; /* mm */
    int32_t y_q8;
    odometry_t step; /* heading; x and y are what is not yet whole units of q8 */
} base_pose_t;

/* Here is the origin. */
void base_pose_reset(base_pose_t *pose);

/* Counts of both wheels in a period, |counts| <= 1000. */
void base_pose_add(base_pose_t *pose, const int32_t counts[2]);

/* Heading, 1/65536 turn. */
angle_t base_pose_heading(const base_pose_t *pose);

#endif
