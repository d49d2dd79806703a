/* One wheel: from a commanded speed or place to a duty, at 100 Hz, in fixed point.
 *
 *   command -> profile (ramp or trapezoid) -> PID on the difference to the encoder -> limits ->
 * duty
 *
 * Speeds are encoder counts per control period of 10 ms in 1/256 (K-Team's speed unit is 256 of
 * them; 100 mm/s = 3072). Accelerations are those per period: K-Team's unit. */
#ifndef APP_WHEEL_H
#define APP_WHEEL_H

#include <stdint.h>

#define WHEEL_DUTY_MAX      255
/* Longest way of one position command, counts (K-Team: 670 m). */
#define WHEEL_WAY_MAX       8388606L
/* So long may a driven wheel stand still, periods; then it is taken for stalled. */
#define WHEEL_STALL_PERIODS 16u

/* Gains as K-Team's commands A and F count them: duty = gain * error / 1024, the error in counts
 * (position) or counts per period (speed), its sum and its difference once a period. */
typedef struct {
    int32_t p, i, d; /* 0..32767 */
} wheel_gains_t;

/* What all wheels share; the owner may change it at any time: it counts within 80 ms. */
typedef struct {
    wheel_gains_t speed;
    wheel_gains_t position;
    int32_t top_mm_s;        /* speed at full duty, 200..3000: of the feed-forward */
    int32_t friction;        /* duty that friction eats, 0..60 */
    int32_t current_percent; /* of the stall current that a motor may draw, 10..100 */
    int32_t tolerance;       /* counts within which a position counts as reached, 0..100 */
} wheel_settings_t;

typedef enum { WHEEL_OFF, WHEEL_PWM, WHEEL_SPEED, WHEEL_POSITION } wheel_mode_t;

typedef struct {
    wheel_mode_t mode;
    int16_t pwm;        /* WHEEL_PWM: commanded duty */
    int32_t command_q8; /* WHEEL_SPEED: where the set speed shall go */
    int32_t ramp_q8;    /* ... and by how much a period */
    int32_t top_q8;     /* WHEEL_POSITION: speed and acceleration of the profile */
    int32_t acceleration_q8;
    int32_t remaining_q8; /* way of the profile still to go */
    int32_t set_q8;       /* set speed of this period */
    int32_t measured_q8;  /* speed of the last period */
    int32_t lag_q8;       /* counts that the wheel is behind its set motion */
    int32_t last_error_q8;
    int32_t sum_q8;   /* of the errors */
    int32_t top_mm_s; /* settings that what follows was computed from */
    int32_t current_percent;
    int32_t duty_q16;      /* feed-forward of a speed of 1/256 */
    int32_t current_limit; /* duty above the speed's own */
    int32_t sum_gain;      /* integral gain that sum_limit_q8 was computed from */
    int32_t sum_limit_q8;
    uint8_t next_look;     /* periods until top_mm_s and current_percent are compared again */
    int16_t duty;          /* the last answer */
    uint8_t still_periods; /* driven, and no count; saturates */
    uint8_t arrived;       /* WHEEL_POSITION: at rest within the tolerance */
} wheel_t;

void wheel_init(wheel_t *wheel);

/* Off: free-wheeling, everything forgotten. */
void wheel_off(wheel_t *wheel);
/* Duty without control, -255..255. */
void wheel_pwm(wheel_t *wheel, int16_t duty);
/* Speed, any; ramp > 0. From rest or on the move. */
void wheel_speed(wheel_t *wheel, int32_t speed_q8, int32_t ramp_q8);
/* Go `way` counts from here (+-WHEEL_WAY_MAX) with top speed 1..127 * 256 and acceleration 1..255.
 */
void wheel_position(wheel_t *wheel, int32_t way, int32_t top_q8, int32_t acceleration_q8);

/* One control period: counts since the last one. Returns the duty. */
int16_t wheel_step(wheel_t *wheel, const wheel_settings_t *settings, int32_t counts);

/* Between two periods, WHEEL_SPEED: the duty as if the ramp had already taken the command up. */
int16_t wheel_refresh(const wheel_t *wheel, const wheel_settings_t *settings);

/* 1 if it has been driven for WHEEL_STALL_PERIODS without a count. */
static inline int wheel_stalled(const wheel_t *wheel)
{
    return wheel->still_periods >= WHEEL_STALL_PERIODS;
}

/* 1 if a position is reached, or a speed is within its tolerance (one count a period). */
int wheel_on_target(const wheel_t *wheel);

/* What K-Team's command K calls the error: counts, or counts per period. */
int32_t wheel_error(const wheel_t *wheel);

#endif
