/* Both wheels: K-Team's motion commands, soccer's wheel speeds, counters, and what stops them.
 *
 * A wheel that is driven and does not turn (blocked, or its encoder or motor is dead) turns both
 * motors off within 200 ms. Soccer is let to try again after MOTION_RETRY_PERIODS, or at once when
 * it asks for the other direction; everybody else has to give a new command. */
#ifndef APP_MOTION_H
#define APP_MOTION_H

#include <stdint.h>

#include "app/wheel.h"

#define MOTION_MAX_MM_S      600 /* of motion_drive() */
#define MOTION_MAX_SPEED     127 /* of motion_speed(), counts a period */
#define MOTION_RETRY_PERIODS 30u

/* Bits of motion_t.fault, and of motion_take_fault(). */
#define MOTION_FAULT_LEFT  1u
#define MOTION_FAULT_RIGHT 2u

/* What can be tuned. */
typedef struct {
    wheel_settings_t wheel;
    int32_t profile_speed[2];        /* counts a period, 1..127; left, right */
    int32_t profile_acceleration[2]; /* counts/256 a period, each period, 1..255 */
    int32_t speed_ramp_mm_s2;        /* of motion_speed(), 100..20000 */
    int32_t drive_ramp_mm_s2;        /* of motion_drive() */
} motion_settings_t;

typedef struct {
    const motion_settings_t *settings;
    wheel_t wheel[2];        /* [0] left, [1] right */
    int32_t position[2];     /* K-Team's position counters, counts; they wrap */
    uint8_t fault;           /* wheels that did not turn: the motors are off */
    uint8_t new_fault;       /* ... not yet told */
    uint8_t driving;         /* soccer drives, */
    int16_t told_mm_s[2];    /* ... and told this, */
    int32_t told_ramp_mm_s2; /* ... with this ramp */
    uint16_t fault_periods;
    int8_t fault_sign[2]; /* direction in which it did not turn */
} motion_t;

/* At rest, motors off. `settings` must outlive the motion and may be changed at any time. */
void motion_init(motion_t *motion, const motion_settings_t *settings);

/* Motors off, faults forgotten. */
void motion_off(motion_t *motion);

/* Command wheel speeds, mm/s, clamped to +-MOTION_MAX_MM_S (both by the same factor, so that the
 * path keeps its curvature). Soccer's way: called as often as it likes. */
void motion_drive(motion_t *motion, int16_t left_mm_s, int16_t right_mm_s);

/* K-Team's commands D, C and P. Speeds in counts a period, +-MOTION_MAX_SPEED; positions are those
 * of the counters; duties -255..255. motion_position() returns 0 and changes nothing if a way is
 * longer than WHEEL_WAY_MAX. */
void motion_speed(motion_t *motion, int32_t left, int32_t right);
int motion_position(motion_t *motion, int32_t left, int32_t right);
void motion_pwm(motion_t *motion, int16_t left, int16_t right);

/* Set the position counters. A position command under way keeps its way. */
void motion_set_counters(motion_t *motion, int32_t left, int32_t right);

/* One control period: counts of both wheels since the last one; sets both duties, -255..255. */
void motion_step(motion_t *motion, const int32_t counts[2], int16_t duty[2]);

/* Between two periods: let the ramp take a new command up at once, and give the duties for it. */
void motion_refresh(motion_t *motion, int16_t duty[2]);

/* Wheels (MOTION_FAULT_*) found stalled since the last call. */
uint8_t motion_take_fault(motion_t *motion);

/* Speed of wheel 0 or 1 in the last period, and the set speed; mm/s. */
int16_t motion_measured_mm_s(const motion_t *motion, unsigned wheel);
int16_t motion_set_mm_s(const motion_t *motion, unsigned wheel);

#endif
