#include "app/pose.h"

void base_pose_reset(base_pose_t *pose)
{
    pose->x_q8 = pose->y_q8 = 0;
    pose->step.x_q16 = pose->step.y_q16 = 0;
    pose->step.heading_q32 = 0;
}

/* Move whole 1/256 mm from `rest` to `sum`, which wraps. */
static void carry(int32_t *sum_q8, int32_t *rest_q16)
{
    int32_t whole = *rest_q16 >> 8;

    *rest_q16 &= 255;
    *sum_q8 = (int32_t)((uint32_t)*sum_q8 + (uint32_t)whole);
}

void base_pose_add(base_pose_t *pose, const int32_t counts[2])
{
    odometry_add(&pose->step, counts[0], counts[1]);
    carry(&pose->x_q8, &pose->step.x_q16);
    carry(&pose->y_q8, &pose->step.y_q16);
}

angle_t base_pose_heading(const base_pose_t *pose)
{
    return angle_wrap((int32_t)((pose->step.heading_q32 + 32768u) >> 16));
}
