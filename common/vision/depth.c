#include "vision/depth.h"

#include "vision/camera.h"

/* Quotient rounded to nearest, ties away from zero; divisor > 0. */
static int32_t divide_rounded(int32_t dividend, int32_t divisor)
{
    if (dividend < 0)
        return -((divisor / 2 - dividend) / divisor);
    return (dividend + divisor / 2) / divisor;
}

static int16_t saturate16(int32_t value)
{
    if (value > INT16_MAX)
        return INT16_MAX;
    if (value < INT16_MIN)
        return INT16_MIN;
    return (int16_t)value;
}

uint16_t depth_mm(uint16_t disparity_q4)
{
    if (disparity_q4 < DEPTH_MIN_DISPARITY_Q4)
        return DEPTH_FAR_MM;
    return (uint16_t)divide_rounded(CAMERA_FOCAL_BASELINE_Q8 / 16, (int32_t)disparity_q4);
}

uint16_t depth_step_mm(uint16_t disparity_q4)
{
    int32_t here_q4;
    int32_t farther_q4;

    if (disparity_q4 < DEPTH_MIN_DISPARITY_Q4 + 1)
        return DEPTH_FAR_MM;
    here_q4 = CAMERA_FOCAL_BASELINE_Q8 / (int32_t)disparity_q4;
    farther_q4 = CAMERA_FOCAL_BASELINE_Q8 / ((int32_t)disparity_q4 - 1);
    return (uint16_t)((farther_q4 - here_q4 + 15) / 16);
}

/* From camera coordinates (right, down, along the axis; all 1/16 mm) into the robot's frame.
 * |along| <= 264000, |right|, |down| <= 132000 (d >= 1 px) keep every product in 31 bits. */
static void to_robot(int32_t right_q4, int32_t down_q4, int32_t along_q4, ground_point_t *point)
{
    const int32_t one = 16L << 12;
    int32_t forward = along_q4 * CAMERA_TILT_COS_Q12 - down_q4 * CAMERA_TILT_SIN_Q12;
    int32_t drop = along_q4 * CAMERA_TILT_SIN_Q12 + down_q4 * CAMERA_TILT_COS_Q12;

    point->forward_mm = saturate16(divide_rounded(forward, one));
    point->left_mm = saturate16(divide_rounded(-right_q4 - CAMERA_RIGHT_LENS_MM_Q4, 16));
    point->height_mm = saturate16(CAMERA_LENS_HEIGHT_MM - divide_rounded(drop, one));
}

int depth_ground_point(uint16_t x_q4, uint16_t y_q4, uint16_t disparity_q4, ground_point_t *point)
{
    int32_t d = disparity_q4;
    int32_t right_q8 = ((int32_t)x_q4 - CAMERA_CX_Q4) * CAMERA_BASELINE_MM_Q8;
    int32_t down_q8 = ((int32_t)y_q4 - CAMERA_CY_Q4) * CAMERA_BASELINE_MM_Q8;

    if (disparity_q4 < DEPTH_MIN_DISPARITY_Q4)
        return 0;
    to_robot(divide_rounded(right_q8, 16 * d), divide_rounded(down_q8, 16 * d),
             divide_rounded(CAMERA_FOCAL_BASELINE_Q8, d), point);
    return 1;
}

int depth_on_plane(uint16_t x_q4, uint16_t y_q4, int16_t height_mm, ground_point_t *point)
{
    int32_t x = (int32_t)x_q4 - CAMERA_CX_Q4;
    int32_t y = (int32_t)y_q4 - CAMERA_CY_Q4;
    int32_t focal_q4 = 16L * CAMERA_FOCAL_PX;
    /* The ray falls by `slope` / focal_q4 for each unit along the axis. */
    int32_t slope = (focal_q4 * CAMERA_TILT_SIN_Q12 + y * CAMERA_TILT_COS_Q12) / 4096;
    int32_t drop_q4 = 16L * (CAMERA_LENS_HEIGHT_MM - height_mm);
    int32_t along_q4;

    /* Below that slope the point is more than 16 m away, which keeps x * along_q4 in 31 bits. */
    if (drop_q4 <= 0 || slope * 50 < drop_q4)
        return 0;
    along_q4 = divide_rounded(drop_q4 * focal_q4, slope);
    to_robot(divide_rounded(x * along_q4, focal_q4), divide_rounded(y * along_q4, focal_q4),
             along_q4, point);
    return 1;
}
