#include "app/motion.h"

/* 12 counts/mm / 100 Hz * 256 = 30.72 per mm/s. */
#define Q8_PER_MM_S(v) ((int32_t)(v)*768 / 25)
/* Acceleration of a wheel: 1500 mm/s^2, 15 mm/s a period. Rubber on wood holds more. */
#define RAMP_Q8        Q8_PER_MM_S(15)
/* Feed-forward: full duty is 1 m/s (30720). An assumption about the motors; the integral makes up
 * for what is wrong with it. */
#define FORWARD_NUM    255
#define FORWARD_DEN    30720
/* Duty per count a period of speed error, and per count of lag. */
#define GAIN_P         3
#define GAIN_I         1
/* Lag that the integral may gather: half the duty. More would only be paid back later. */
#define LAG_LIMIT_Q8   (128L * 256 / GAIN_I)
#define DUTY_LIMIT     255

static int32_t clamp(int32_t value, int32_t limit)
{
    if (value > limit)
        return limit;
    return value < -limit ? -limit : value;
}

void motion_init(motion_t *motion)
{
    unsigned i;

    for (i = 0; i < 2; i++) {
        motion->wheel[i].measured_q8 = 0;
    }
    motion_halt(motion);
}

void motion_halt(motion_t *motion)
{
    unsigned i;

    for (i = 0; i < 2; i++) {
        motion->wheel[i].command_q8 = 0;
        motion->wheel[i].set_q8 = 0;
        motion->wheel[i].lag_q8 = 0;
    }
}

void motion_command(motion_t *motion, int16_t left_mm_s, int16_t right_mm_s)
{
    int32_t left = left_mm_s;
    int32_t right = right_mm_s;
    int32_t size_left = left < 0 ? -left : left;
    int32_t size_right = right < 0 ? -right : right;
    int32_t largest = size_left > size_right ? size_left : size_right;

    if (largest > MOTION_MAX_MM_S) {
        left = left * MOTION_MAX_MM_S / largest;
        right = right * MOTION_MAX_MM_S / largest;
    }
    motion->wheel[0].command_q8 = Q8_PER_MM_S(left);
    motion->wheel[1].command_q8 = Q8_PER_MM_S(right);
}

static void ramp(wheel_t *wheel)
{
    wheel->set_q8 += clamp(wheel->command_q8 - wheel->set_q8, RAMP_Q8);
}

static int16_t wheel_duty(const wheel_t *wheel)
{
    int32_t forward = wheel->set_q8 * FORWARD_NUM / FORWARD_DEN;
    int32_t error = wheel->set_q8 - wheel->measured_q8;
    int32_t feedback = (GAIN_P * error + GAIN_I * wheel->lag_q8) / 256;

    /* At rest and on the spot: off, not humming. */
    if (wheel->command_q8 == 0 && wheel->set_q8 == 0 && wheel->measured_q8 == 0)
        return 0;
    return (int16_t)clamp(forward + feedback, DUTY_LIMIT);
}

void motion_step(motion_t *motion, const int32_t counts[2], int16_t duty[2])
{
    unsigned i;

    for (i = 0; i < 2; i++) {
        wheel_t *wheel = &motion->wheel[i];

        wheel->measured_q8 = clamp(counts[i], 1000) * 256;
        wheel->lag_q8 = clamp(wheel->lag_q8 + wheel->set_q8 - wheel->measured_q8, LAG_LIMIT_Q8);
        if (wheel->command_q8 == 0 && wheel->set_q8 == 0 && wheel->measured_q8 == 0)
            wheel->lag_q8 = 0;
        ramp(wheel);
        duty[i] = wheel_duty(wheel);
    }
}

void motion_refresh(motion_t *motion, int16_t duty[2])
{
    unsigned i;

    for (i = 0; i < 2; i++) {
        wheel_t ahead = motion->wheel[i];

        /* On a copy: the ramp itself advances once a period. */
        ramp(&ahead);
        duty[i] = wheel_duty(&ahead);
    }
}

static int16_t to_mm_s(int32_t speed_q8)
{
    return (int16_t)(speed_q8 * 25 / 768);
}

int16_t motion_measured_mm_s(const motion_t *motion, unsigned wheel)
{
    return to_mm_s(motion->wheel[wheel].measured_q8);
}

int16_t motion_set_mm_s(const motion_t *motion, unsigned wheel)
{
    return to_mm_s(motion->wheel[wheel].set_q8);
}
