/* Small things of plane geometry that world model and own place share. */
#ifndef SOCCER_PLANE_H
#define SOCCER_PLANE_H

#include <stdint.h>

#include "soccer/angle.h"
#include "soccer/odometry.h"
#include "soccer/sighting.h"

typedef struct {
    int32_t cosine_q14;
    int32_t sine_q14;
} rotation_t;

static inline int32_t plane_clamp(int32_t value, int32_t low, int32_t high)
{
    if (value < low)
        return low;
    return value > high ? high : value;
}

static inline void rotation_by(angle_t angle, rotation_t *rotation)
{
    rotation->cosine_q14 = angle_cos_q14(angle);
    rotation->sine_q14 = angle_sin_q14(angle);
}

/* |x|, |y| <= 60000, 3.7 m in 1/16 mm: everything on the pitch, seen from a belief about the robot
 * that odometry keeps within 2 m. */
static inline void rotate(const rotation_t *by, int32_t x, int32_t y, int32_t *to_x, int32_t *to_y)
{
    *to_x = (x * by->cosine_q14 - y * by->sine_q14) >> 14;
    *to_y = (x * by->sine_q14 + y * by->cosine_q14) >> 14;
}

/* Where in the field is what a robot at `pose` sees there? `turn`: by the pose's heading. */
static inline void place_in_field(const pose_t *pose, const rotation_t *turn, const place_t *place,
                                  int32_t *x_q4, int32_t *y_q4)
{
    rotate(turn, place->forward_mm * 16, place->left_mm * 16, x_q4, y_q4);
    *x_q4 += pose->x_q4;
    *y_q4 += pose->y_q4;
}

#endif
