#include "app/motion.h"

#include "app/seldom.h"

/* 12 counts/mm / 100 Hz * 256 = 30.72 per mm/s; a ramp in mm/s^2 is 1/100 of that a period. */
#define Q8_PER_MM_S(v) ((int32_t)(v)*768 / 25)
#define RAMP_Q8(mm_s2) ((mm_s2)*192 / 625)
#define MM_S_OF_Q8(v)  ((int16_t)((v)*25 / 768))

static int8_t sign_of(int32_t value)
{
    return (int8_t)((value > 0) - (value < 0));
}

void motion_init(motion_t *motion, const motion_settings_t *settings)
{
    unsigned i;

    motion->settings = settings;
    motion->new_fault = 0;
    for (i = 0; i < 2; i++) {
        wheel_init(&motion->wheel[i]);
        motion->position[i] = 0;
        motion->fault_sign[i] = 0;
    }
    motion_off(motion);
}

static void all_off(motion_t *motion)
{
    unsigned i;

    for (i = 0; i < 2; i++)
        wheel_off(&motion->wheel[i]);
}

void motion_off(motion_t *motion)
{
    all_off(motion);
    motion->fault = 0;
    motion->driving = 0;
}

/* Any new command of a person or a program forgives a stall. */
static void begin_command(motion_t *motion)
{
    if (motion->fault || motion->driving)
        all_off(motion);
    motion->fault = 0;
    motion->driving = 0;
}

void motion_speed(motion_t *motion, int32_t left, int32_t right)
{
    int32_t ramp_q8 = RAMP_Q8(motion->settings->speed_ramp_mm_s2);

    begin_command(motion);
    wheel_speed(&motion->wheel[0], left * 256, ramp_q8);
    wheel_speed(&motion->wheel[1], right * 256, ramp_q8);
}

int motion_position(motion_t *motion, int32_t left, int32_t right)
{
    const motion_settings_t *settings = motion->settings;
    const int32_t target[2] = {left, right};
    int32_t way[2];
    unsigned i;

    for (i = 0; i < 2; i++) {
        /* Unsigned: the counters wrap. */
        way[i] = (int32_t)((uint32_t)target[i] - (uint32_t)motion->position[i]);
        if (way[i] > WHEEL_WAY_MAX || way[i] < -WHEEL_WAY_MAX)
            return 0;
    }
    begin_command(motion);
    for (i = 0; i < 2; i++)
        wheel_position(&motion->wheel[i], way[i], settings->profile_speed[i] * 256,
                       settings->profile_acceleration[i]);
    return 1;
}

void motion_pwm(motion_t *motion, int16_t left, int16_t right)
{
    begin_command(motion);
    wheel_pwm(&motion->wheel[0], left);
    wheel_pwm(&motion->wheel[1], right);
}

static int may_try_again(const motion_t *motion, const int32_t speed_q8[2])
{
    unsigned i;

    if (motion->fault_periods >= MOTION_RETRY_PERIODS)
        return 1;
    for (i = 0; i < 2; i++)
        if (motion->fault_sign[i] != 0 && sign_of(speed_q8[i]) == motion->fault_sign[i])
            return 0;
    return 1;
}

/* Soccer tells each tick what it changes with a decision. Returns 1 if this is nothing new. */
static int was_told(motion_t *motion, int16_t left_mm_s, int16_t right_mm_s)
{
    int32_t ramp = motion->settings->drive_ramp_mm_s2;

    if (motion->driving && !motion->fault && left_mm_s == motion->told_mm_s[0] &&
        right_mm_s == motion->told_mm_s[1] && ramp == motion->told_ramp_mm_s2)
        return 1;
    motion->told_mm_s[0] = left_mm_s;
    motion->told_mm_s[1] = right_mm_s;
    motion->told_ramp_mm_s2 = ramp;
    return 0;
}

SELDOM static void drive(motion_t *motion, int16_t left_mm_s, int16_t right_mm_s)
{
    int32_t left = left_mm_s;
    int32_t right = right_mm_s;
    int32_t ramp_q8 = RAMP_Q8(motion->settings->drive_ramp_mm_s2);
    int32_t size_left = left < 0 ? -left : left;
    int32_t size_right = right < 0 ? -right : right;
    int32_t largest = size_left > size_right ? size_left : size_right;
    int32_t speed_q8[2];

    if (largest > MOTION_MAX_MM_S) {
        left = left * MOTION_MAX_MM_S / largest;
        right = right * MOTION_MAX_MM_S / largest;
    }
    speed_q8[0] = Q8_PER_MM_S(left);
    speed_q8[1] = Q8_PER_MM_S(right);
    if (motion->fault) {
        if (!may_try_again(motion, speed_q8))
            return;
        motion->fault = 0;
    }
    motion->driving = 1;
    wheel_speed(&motion->wheel[0], speed_q8[0], ramp_q8);
    wheel_speed(&motion->wheel[1], speed_q8[1], ramp_q8);
}

void motion_drive(motion_t *motion, int16_t left_mm_s, int16_t right_mm_s)
{
    if (!was_told(motion, left_mm_s, right_mm_s))
        drive(motion, left_mm_s, right_mm_s);
}

void motion_set_counters(motion_t *motion, int32_t left, int32_t right)
{
    motion->position[0] = left;
    motion->position[1] = right;
}

static void declare_fault(motion_t *motion, uint8_t fault)
{
    unsigned i;

    for (i = 0; i < 2; i++)
        motion->fault_sign[i] = (int8_t)(fault & 1u << i ? sign_of(motion->wheel[i].duty) : 0);
    motion->fault = fault;
    motion->new_fault |= fault;
    motion->fault_periods = 0;
    all_off(motion);
}

static void check_for_stall(motion_t *motion)
{
    uint8_t fault = 0;

    if (wheel_stalled(&motion->wheel[0]))
        fault |= MOTION_FAULT_LEFT;
    if (wheel_stalled(&motion->wheel[1]))
        fault |= MOTION_FAULT_RIGHT;
    if (fault != 0)
        declare_fault(motion, fault);
}

void motion_step(motion_t *motion, const int32_t counts[2], int16_t duty[2])
{
    unsigned i;

    for (i = 0; i < 2; i++) {
        motion->position[i] = (int32_t)((uint32_t)motion->position[i] + (uint32_t)counts[i]);
        duty[i] = wheel_step(&motion->wheel[i], &motion->settings->wheel, counts[i]);
    }
    if (motion->fault == 0)
        check_for_stall(motion);
    else if (motion->fault_periods < UINT16_MAX)
        motion->fault_periods++;
    if (motion->fault != 0)
        duty[0] = duty[1] = 0;
}

void motion_refresh(motion_t *motion, int16_t duty[2])
{
    unsigned i;

    for (i = 0; i < 2; i++)
        duty[i] = motion->fault ? 0 : wheel_refresh(&motion->wheel[i], &motion->settings->wheel);
}

uint8_t motion_take_fault(motion_t *motion)
{
    uint8_t fault = motion->new_fault;

    motion->new_fault = 0;
    return fault;
}

int16_t motion_measured_mm_s(const motion_t *motion, unsigned wheel)
{
    return MM_S_OF_Q8(motion->wheel[wheel].measured_q8);
}

int16_t motion_set_mm_s(const motion_t *motion, unsigned wheel)
{
    return MM_S_OF_Q8(motion->wheel[wheel].set_q8);
}
