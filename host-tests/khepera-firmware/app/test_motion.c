// sources: khepera-firmware/app/motion.c
// includes: khepera-firmware
/* The wheel controller on a motor with lag, dead band and a wrong top speed. */
#include "app/motion.h"

#include <math.h>
#include <unity.h>

#define LEFT  0
#define RIGHT 1

static motion_t motion;
static double speed_mm_s[2];
static double travel_mm[2];
static int32_t last[2];
static int16_t duty[2];
/* The motors' truth: full speed, mm/s, time constant, s, and the duty that friction eats. */
static double full_mm_s;
static double dead_band;

void setUp(void)
{
    unsigned i;

    motion_init(&motion);
    for (i = 0; i < 2; i++) {
        speed_mm_s[i] = 0;
        travel_mm[i] = 0;
        last[i] = 0;
    }
    full_mm_s = 1000;
    dead_band = 0;
}

void tearDown(void) {}

static void run(int ticks)
{
    int32_t counts[2];
    int tick;
    int ms;
    unsigned i;

    for (tick = 0; tick < ticks; tick++) {
        for (i = 0; i < 2; i++) {
            int32_t now = (int32_t)floor(travel_mm[i] * 12);

            counts[i] = now - last[i];
            last[i] = now;
        }
        motion_step(&motion, counts, duty);
        for (ms = 0; ms < 10; ms++) {
            for (i = 0; i < 2; i++) {
                double drive = fmax(fabs((double)duty[i]) - dead_band, 0) / 255;

                speed_mm_s[i] +=
                    (copysign(drive, duty[i]) * full_mm_s - speed_mm_s[i]) * 0.001 / 0.05;
                travel_mm[i] += speed_mm_s[i] * 0.001;
            }
        }
    }
}

static double mean_speed(unsigned wheel, int ticks)
{
    double before = travel_mm[wheel];

    run(ticks);
    return (travel_mm[wheel] - before) / (0.01 * ticks);
}

static void both_wheels_reach_their_speed(void)
{
    motion_command(&motion, 300, -120);
    run(50);
    TEST_ASSERT_INT_WITHIN(6, 300, lround(mean_speed(LEFT, 20)));
    TEST_ASSERT_INT_WITHIN(6, -120, lround(mean_speed(RIGHT, 20)));
    TEST_ASSERT_INT_WITHIN(10, 300, motion_measured_mm_s(&motion, LEFT));
}

static void a_weak_motor_with_friction_reaches_it_too(void)
{
    full_mm_s = 800;
    dead_band = 12;
    motion_command(&motion, 200, 200);
    run(150);
    TEST_ASSERT_INT_WITHIN(6, 200, lround(mean_speed(LEFT, 50)));
}

static void it_does_not_overshoot_much(void)
{
    double fastest = 0;
    int i;

    motion_command(&motion, 400, 400);
    for (i = 0; i < 80; i++) {
        run(1);
        fastest = fmax(fastest, speed_mm_s[LEFT]);
    }
    TEST_ASSERT_TRUE(fastest < 400 * 1.15);
}

static void acceleration_is_limited(void)
{
    motion_command(&motion, 600, 600);
    run(10);
    TEST_ASSERT_INT_WITHIN(1, 150, motion_set_mm_s(&motion, LEFT));
}

static void too_fast_a_command_keeps_its_curvature(void)
{
    motion_command(&motion, 1200, 600);
    run(100);
    TEST_ASSERT_INT_WITHIN(1, 600, motion_set_mm_s(&motion, LEFT));
    TEST_ASSERT_INT_WITHIN(1, 300, motion_set_mm_s(&motion, RIGHT));
}

static void at_rest_the_motors_are_off(void)
{
    motion_command(&motion, 300, 300);
    run(50);
    motion_command(&motion, 0, 0);
    run(100);
    TEST_ASSERT_EQUAL_INT(0, duty[LEFT]);
    TEST_ASSERT_EQUAL_INT(0, duty[RIGHT]);
    TEST_ASSERT_TRUE(fabs(speed_mm_s[LEFT]) < 1);
}

static void a_blocked_wheel_gets_a_limited_duty_and_recovers(void)
{
    full_mm_s = 0;
    motion_command(&motion, 100, 100);
    run(300);
    TEST_ASSERT_TRUE(duty[LEFT] <= 200);
    full_mm_s = 1000;
    run(100);
    TEST_ASSERT_INT_WITHIN(8, 100, lround(mean_speed(LEFT, 20)));
}

static void a_new_command_shows_before_the_next_period(void)
{
    int16_t early[2];

    run(1);
    motion_command(&motion, 300, 300);
    motion_refresh(&motion, early);
    TEST_ASSERT_TRUE(early[LEFT] > 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(both_wheels_reach_their_speed);
    RUN_TEST(a_weak_motor_with_friction_reaches_it_too);
    RUN_TEST(it_does_not_overshoot_much);
    RUN_TEST(acceleration_is_limited);
    RUN_TEST(too_fast_a_command_keeps_its_curvature);
    RUN_TEST(at_rest_the_motors_are_off);
    RUN_TEST(a_blocked_wheel_gets_a_limited_duty_and_recovers);
    RUN_TEST(a_new_command_shows_before_the_next_period);
    return UNITY_END();
}
