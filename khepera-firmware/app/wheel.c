#include "app/wheel.h"

#include "app/seldom.h"
#include "soccer/angle.h"

/* 12 counts/mm / 100 Hz * 256 = 30.72 per mm/s. */
#define Q8_PER_MM_S(v) ((v)*768 / 25)
#define GAIN_ONE       1024
/* Errors are held below this, so that 32767 times them fits 32 bits. */
#define ERROR_LIMIT_Q8 65535L
/* At this duty a healthy wheel turns: more than friction takes at rest. */
#define STALL_DUTY     12
#define COUNTS_LIMIT   1000
/* From one look at settings that nobody changes to the next. */
#define LOOK_PERIODS   7u

static int32_t clamp(int32_t value, int32_t limit)
{
    if (value > limit)
        return limit;
    return value < -limit ? -limit : value;
}

static int32_t size_of(int32_t value)
{
    return value < 0 ? -value : value;
}

static void forget(wheel_t *wheel)
{
    wheel->command_q8 = 0;
    wheel->remaining_q8 = 0;
    wheel->set_q8 = 0;
    wheel->lag_q8 = 0;
    wheel->last_error_q8 = 0;
    wheel->sum_q8 = 0;
    wheel->still_periods = 0;
    wheel->arrived = 0;
}

void wheel_init(wheel_t *wheel)
{
    wheel->measured_q8 = 0;
    wheel->top_q8 = 256;
    wheel->acceleration_q8 = 1;
    wheel->ramp_q8 = 1;
    wheel->sum_gain = -1;
    wheel->top_mm_s = 0; /* none: see take_settings() */
    wheel->next_look = 0;
    wheel_off(wheel);
}

void wheel_off(wheel_t *wheel)
{
    wheel->mode = WHEEL_OFF;
    wheel->pwm = 0;
    wheel->duty = 0;
    forget(wheel);
}

void wheel_pwm(wheel_t *wheel, int16_t duty)
{
    forget(wheel);
    wheel->mode = WHEEL_PWM;
    wheel->pwm = (int16_t)clamp(duty, WHEEL_DUTY_MAX);
}

/* A controller takes over from whatever was before, at the speed that the wheel has. */
static void take_over(wheel_t *wheel, wheel_mode_t mode)
{
    if (wheel->mode == mode)
        return;
    forget(wheel);
    wheel->set_q8 = wheel->measured_q8;
    wheel->mode = mode;
}

void wheel_speed(wheel_t *wheel, int32_t speed_q8, int32_t ramp_q8)
{
    take_over(wheel, WHEEL_SPEED);
    wheel->command_q8 = speed_q8;
    wheel->ramp_q8 = ramp_q8;
}

static int32_t limit_way(int64_t way_q8)
{
    if (way_q8 > INT32_MAX)
        return INT32_MAX;
    return way_q8 < -INT32_MAX ? -INT32_MAX : (int32_t)way_q8;
}

void wheel_position(wheel_t *wheel, int32_t way, int32_t top_q8, int32_t acceleration_q8)
{
    take_over(wheel, WHEEL_POSITION);
    /* `way` counts from where the wheel is; the profile goes on from where it should be at the end
     * of this period. */
    wheel->remaining_q8 =
        limit_way((int64_t)clamp(way, WHEEL_WAY_MAX) * 256 - wheel->lag_q8 - wheel->set_q8);
    wheel->top_q8 = top_q8;
    wheel->acceleration_q8 = acceleration_q8;
    wheel->arrived = 0;
    wheel->still_periods = 0;
}

/* ---- Profiles ---- */

/* The ramp's next speed. */
static int32_t next_set(const wheel_t *wheel)
{
    return wheel->set_q8 + clamp(wheel->command_q8 - wheel->set_q8, wheel->ramp_q8);
}

/* The greatest speed from which the profile still stops within `way`. */
static int32_t braking_speed_q8(int32_t way_q8, int32_t acceleration_q8)
{
    /* v^2 / 2a + v / 2 <= way, the second term because the way of a period is that of its end. */
    uint32_t half = (uint32_t)acceleration_q8 / 2u;

    return (int32_t)(square_root(2u * (uint32_t)acceleration_q8 * (uint32_t)way_q8 + half * half) -
                     half);
}

static void trapezoid(wheel_t *wheel)
{
    int32_t sign = wheel->remaining_q8 < 0 ? -1 : 1;
    int32_t way_q8 = sign * wheel->remaining_q8;
    int32_t speed_q8 = sign * wheel->set_q8; /* towards the target */
    int32_t a_q8 = wheel->acceleration_q8;
    int32_t next_q8 = speed_q8 + a_q8;
    /* Above this way any speed can brake; and what is below does not overflow. */
    int32_t far_q8 = wheel->top_q8 * (wheel->top_q8 / (2 * a_q8) + 2);

    if (way_q8 < far_q8) {
        int32_t braking_q8 = braking_speed_q8(way_q8, a_q8);

        if (next_q8 > braking_q8)
            next_q8 = braking_q8;
    }
    if (next_q8 > wheel->top_q8)
        next_q8 = wheel->top_q8;
    /* A command on the move may ask for more than the profile's braking: it overshoots and comes
     * back rather than let the wheels slip. */
    if (next_q8 < speed_q8 - a_q8)
        next_q8 = speed_q8 - a_q8;
    if (way_q8 <= a_q8 && next_q8 <= a_q8)
        next_q8 = way_q8;
    wheel->set_q8 = sign * next_q8;
    wheel->remaining_q8 -= wheel->set_q8;
}

/* ---- Control ---- */

/* Divisions are dear: done when a setting has changed. */
SELDOM static void take_settings(wheel_t *wheel, const wheel_settings_t *settings)
{
    wheel->next_look = LOOK_PERIODS;
    if (wheel->top_mm_s == settings->top_mm_s &&
        wheel->current_percent == settings->current_percent)
        return;
    wheel->top_mm_s = settings->top_mm_s;
    wheel->current_percent = settings->current_percent;
    wheel->duty_q16 = WHEEL_DUTY_MAX * 65536L / Q8_PER_MM_S(settings->top_mm_s);
    wheel->current_limit = WHEEL_DUTY_MAX * settings->current_percent / 100;
}

/* Duty that a motor needs to turn at this speed without a load. */
static int32_t forward_duty(const wheel_t *wheel, int32_t speed_q8)
{
    return speed_q8 * wheel->duty_q16 / 65536;
}

/* `value` with the sign of `of`, 0 for 0. */
static int32_t signed_like(int32_t value, int32_t of)
{
    if (of == 0)
        return 0;
    return of > 0 ? value : -value;
}

static int32_t pid(const wheel_gains_t *gains, int32_t error_q8, int32_t sum_q8, int32_t change_q8)
{
    return gains->p * clamp(error_q8, ERROR_LIMIT_Q8) / (256 * GAIN_ONE) +
           gains->i * clamp(sum_q8, ERROR_LIMIT_Q8) / (256 * GAIN_ONE) +
           gains->d * clamp(change_q8, ERROR_LIMIT_Q8) / (256 * GAIN_ONE);
}

/* Keep the integral's share within the duty: more would only be paid back later. */
static int32_t limit_sum(wheel_t *wheel, const wheel_gains_t *gains, int32_t sum_q8)
{
    if (wheel->sum_gain != gains->i) {
        wheel->sum_gain = gains->i;
        wheel->sum_limit_q8 = gains->i == 0 ? 0 : WHEEL_DUTY_MAX * 128 * GAIN_ONE / gains->i;
        if (wheel->sum_limit_q8 > ERROR_LIMIT_Q8)
            wheel->sum_limit_q8 = ERROR_LIMIT_Q8;
    }
    return clamp(sum_q8, wheel->sum_limit_q8);
}

/* With this set speed. */
static int32_t speed_duty(const wheel_t *wheel, const wheel_settings_t *settings, int32_t set_q8)
{
    int32_t error_q8 = set_q8 - wheel->measured_q8;

    /* At rest and on the spot: off, not humming. */
    if (wheel->command_q8 == 0 && set_q8 == 0 && wheel->measured_q8 == 0)
        return 0;
    return forward_duty(wheel, set_q8) + signed_like(settings->friction, set_q8) +
           pid(&settings->speed, error_q8, wheel->lag_q8, error_q8 - wheel->last_error_q8);
}

static int32_t step_speed(wheel_t *wheel, const wheel_settings_t *settings)
{
    int32_t duty;

    wheel->lag_q8 =
        limit_sum(wheel, &settings->speed, wheel->lag_q8 + wheel->set_q8 - wheel->measured_q8);
    if (wheel->command_q8 == 0 && wheel->set_q8 == 0 && wheel->measured_q8 == 0)
        wheel->lag_q8 = 0;
    wheel->set_q8 = next_set(wheel);
    duty = speed_duty(wheel, settings, wheel->set_q8);
    wheel->last_error_q8 = wheel->set_q8 - wheel->measured_q8;
    return duty;
}

SELDOM static int32_t step_position(wheel_t *wheel, const wheel_settings_t *settings)
{
    const wheel_gains_t *gains = &settings->position;
    int32_t near_q8 = settings->tolerance * 256;
    int32_t change_q8 = wheel->set_q8 - wheel->measured_q8;
    int32_t push;

    wheel->lag_q8 += change_q8;
    trapezoid(wheel);
    if (wheel->set_q8 == 0 && wheel->remaining_q8 == 0 && wheel->measured_q8 == 0 &&
        size_of(wheel->lag_q8) <= near_q8) {
        wheel->arrived = 1;
        wheel->sum_q8 = 0;
        return 0; /* held by the gears; pushed out of the tolerance, it comes back */
    }
    if (size_of(wheel->lag_q8) > near_q8 || wheel->set_q8 != 0)
        wheel->arrived = 0;
    wheel->sum_q8 = limit_sum(wheel, gains, wheel->sum_q8 + wheel->lag_q8);
    push = signed_like(settings->friction, wheel->set_q8 != 0 ? wheel->set_q8 : wheel->lag_q8);
    return forward_duty(wheel, wheel->set_q8) + push +
           pid(gains, wheel->lag_q8, wheel->sum_q8, wheel->set_q8 - wheel->measured_q8);
}

/* The motor's current follows from what the duty is above the speed's own voltage. */
static int32_t limit_current(const wheel_t *wheel, int32_t duty)
{
    int32_t own = forward_duty(wheel, wheel->measured_q8);

    return clamp(own + clamp(duty - own, wheel->current_limit), WHEEL_DUTY_MAX);
}

static void watch_for_stall(wheel_t *wheel, int32_t counts)
{
    if (counts != 0 || size_of(wheel->duty) < STALL_DUTY)
        wheel->still_periods = 0;
    else if (wheel->still_periods < UINT8_MAX)
        wheel->still_periods++;
}

static int is_zero(const wheel_gains_t *gains)
{
    return gains->p == 0 && gains->i == 0 && gains->d == 0;
}

/* All gains 0 switch a controller off, feed-forward included. */
static int32_t control(wheel_t *wheel, const wheel_settings_t *settings)
{
    int position = wheel->mode == WHEEL_POSITION;
    int32_t duty;

    if (wheel->next_look-- == 0)
        take_settings(wheel, settings);
    duty = position ? step_position(wheel, settings) : step_speed(wheel, settings);

    if (is_zero(position ? &settings->position : &settings->speed))
        return 0;
    return limit_current(wheel, duty);
}

int16_t wheel_step(wheel_t *wheel, const wheel_settings_t *settings, int32_t counts)
{
    int32_t duty = 0;

    watch_for_stall(wheel, counts);
    wheel->measured_q8 = clamp(counts, COUNTS_LIMIT) * 256;
    switch (wheel->mode) {
    case WHEEL_OFF:
        break;
    case WHEEL_PWM:
        duty = wheel->pwm;
        break;
    case WHEEL_SPEED:
    case WHEEL_POSITION:
        duty = control(wheel, settings);
        break;
    }
    wheel->duty = (int16_t)duty;
    return wheel->duty;
}

int16_t wheel_refresh(const wheel_t *wheel, const wheel_settings_t *settings)
{
    if (wheel->mode != WHEEL_SPEED || is_zero(&settings->speed))
        return wheel->duty;
    /* The ramp itself advances once a period. */
    return (int16_t)limit_current(wheel, speed_duty(wheel, settings, next_set(wheel)));
}

int wheel_on_target(const wheel_t *wheel)
{
    if (wheel->mode == WHEEL_SPEED)
        return wheel->set_q8 == wheel->command_q8 &&
               size_of(wheel->set_q8 - wheel->measured_q8) <= 256;
    return wheel->mode != WHEEL_POSITION || wheel->arrived;
}

int32_t wheel_error(const wheel_t *wheel)
{
    if (wheel->mode == WHEEL_SPEED)
        return (wheel->command_q8 - wheel->measured_q8) / 256;
    return wheel->mode == WHEEL_POSITION ? (wheel->remaining_q8 + wheel->lag_q8) / 256 : 0;
}
