/* Wheel speeds: one PI controller with feed-forward for each wheel, in fixed point, at 100 Hz.
 *
 * Speeds inside are encoder counts per control period in 1/256 (100 mm/s = 12 counts = 3072). The
 * set speed follows the commanded one at a limited acceleration, so that the wheels do not slip. */
#ifndef APP_MOTION_H
#define APP_MOTION_H

#include <stdint.h>

#define MOTION_MAX_MM_S 600

typedef struct {
    int32_t command_q8;  /* where the set speed shall go */
    int32_t set_q8;      /* ramped */
    int32_t measured_q8; /* of the last period */
    int32_t lag_q8;      /* counts that the wheel is behind: the integral of the speed error */
} wheel_t;

typedef struct {
    wheel_t wheel[2]; /* [0] left, [1] right */
} motion_t;

/* At rest. */
void motion_init(motion_t *motion);

/* Command wheel speeds, mm/s, clamped to +-MOTION_MAX_MM_S (both by the same factor, so that the
 * path keeps its curvature). */
void motion_command(motion_t *motion, int16_t left_mm_s, int16_t right_mm_s);

/* One control period: counts of both wheels since the last one; sets both duties, -255..255. */
void motion_step(motion_t *motion, const int32_t counts[2], int16_t duty[2]);

/* Between two periods: let the ramp take a new command up at once, and give the duties for it. */
void motion_refresh(motion_t *motion, int16_t duty[2]);

/* Command zero, forget ramp and integral: the caller turns the motors off. */
void motion_halt(motion_t *motion);

/* Speed of wheel 0 or 1 in the last period, and the set speed; mm/s. */
int16_t motion_measured_mm_s(const motion_t *motion, unsigned wheel);
int16_t motion_set_mm_s(const motion_t *motion, unsigned wheel);

#endif
