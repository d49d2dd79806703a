#include "soccer/odometry.h"

#include "board/khepera.h"

/* Heading of one count of difference between the wheels: 2^32 / (2 pi * 12 / mm * 53 mm). */
#define TURN_PER_COUNT_Q32 1074791L
#define LIMIT_Q16          (2000L << 16)

#if BOARD_PULSES_PER_MM != 12 || BOARD_WHEEL_BASE_MM != 53
#error "TURN_PER_COUNT_Q32 belongs to other wheels"
#endif

static int32_t add_limited(int32_t at_q16, int32_t step_q16)
{
    int32_t sum = at_q16 + step_q16;

    if (sum > LIMIT_Q16)
        return LIMIT_Q16;
    return sum < -LIMIT_Q16 ? -LIMIT_Q16 : sum;
}

/* A way's share along an axis, 1/65536 mm. */
static int32_t along_q16(int32_t way_q12, int16_t cosine_q14)
{
    /* A way of a tick, up to 32 mm, in 32 bits: longer products are dear. */
    if (way_q12 < 1L << 17 && way_q12 > -(1L << 17))
        return (way_q12 * cosine_q14) >> 10;
    return (int32_t)(((int64_t)way_q12 * cosine_q14) >> 10);
}

void odometry_set(odometry_t *odometry, const pose_t *pose)
{
    odometry->x_q16 = pose->x_q4 * 4096;
    odometry->y_q16 = pose->y_q4 * 4096;
    odometry->heading_q32 = (uint32_t)(uint16_t)pose->heading << 16;
}

void odometry_add(odometry_t *odometry, int32_t left_counts, int32_t right_counts)
{
    /* Half counts (1/24 mm) to 1/4096 mm, then times a q14 cosine: below 2^31 up to 1000 counts. */
    int32_t forward_q12 = (left_counts + right_counts) * 4096 / (2 * BOARD_PULSES_PER_MM);
    uint32_t turn_q32 = (uint32_t)((right_counts - left_counts) * TURN_PER_COUNT_Q32);
    uint32_t turn_half_q32 = (uint32_t)((int32_t)turn_q32 / 2);
    angle_t mean = angle_wrap((int32_t)((odometry->heading_q32 + turn_half_q32) >> 16));

    odometry->x_q16 = add_limited(odometry->x_q16, along_q16(forward_q12, angle_cos_q14(mean)));
    odometry->y_q16 = add_limited(odometry->y_q16, along_q16(forward_q12, angle_sin_q14(mean)));
    odometry->heading_q32 += turn_q32;
}

void odometry_pose(const odometry_t *odometry, pose_t *pose)
{
    pose->x_q4 = (odometry->x_q16 + 2048) >> 12;
    pose->y_q4 = (odometry->y_q16 + 2048) >> 12;
    pose->heading = angle_wrap((int32_t)((odometry->heading_q32 + 32768u) >> 16));
}
