// sources: khepera-firmware/soccer/angle.c khepera-firmware/soccer/odometry.c
// sources: khepera-firmware/soccer/sighting.c khepera-firmware/soccer/own_place.c
// sources: khepera-firmware/soccer/world.c khepera-firmware/soccer/strategy.c
// sources: khepera-firmware/soccer/soccer.c khepera-firmware/soccer/tuning.c
// sources: common/vision/depth.c
// includes: khepera-firmware
/* Reports that tell of nothing: dark eyes in the open, a wall right before them otherwise. */
#include "soccer/soccer.h"

#include <unity.h>

static soccer_t soccer;

void setUp(void)
{
    soccer_init(&soccer, &soccer_tuning_default);
    soccer.world.own.localised = 1;
}

void tearDown(void) {}

static void stand_at(int32_t x_mm, int32_t y_mm, angle_t heading)
{
    const pose_t pose = {x_mm * 16, y_mm * 16, heading};

    odometry_set(&soccer.world.odometry, &pose);
}

/* Time passes with a report in every other tick that tells of nothing. */
static void see_nothing(unsigned ticks)
{
    static const int32_t stands[2] = {0, 0};
    report_t report = {0};

    report.function = FPGA_FUNCTION_SOCCER;
    for (; ticks > 0; ticks--) {
        soccer_tick(&soccer, stands);
        if (ticks % 2 == 0)
            soccer_see(&soccer, &report, 0);
    }
}

static void in_the_open_eyes_that_see_nothing_stop_the_motors(void)
{
    wheels_t wheels;

    stand_at(0, 0, 0);
    see_nothing(SOCCER_DARK_TICKS - 2u);
    TEST_ASSERT_TRUE(soccer_wheels(&soccer, &wheels));
    see_nothing(4);
    TEST_ASSERT_FALSE(soccer_wheels(&soccer, &wheels));
}

static void close_before_a_wall_they_do_not_stop_them(void)
{
    wheels_t wheels;

    stand_at(430, 0, 0);
    see_nothing(SOCCER_BLIND_SPOT_TICKS - 4u);
    TEST_ASSERT_TRUE(soccer_wheels(&soccer, &wheels));
}

static void after_a_second_there_it_turns_away_at_once(void)
{
    wheels_t wheels;
    unsigned i;

    stand_at(430, 0, 0);
    see_nothing(SOCCER_BLIND_SPOT_TICKS);
    for (i = 0; i < 50; i++) {
        see_nothing(4);
        TEST_ASSERT_TRUE(soccer_wheels(&soccer, &wheels));
        TEST_ASSERT_EQUAL_INT16(-wheels.left_mm_s, wheels.right_mm_s);
        TEST_ASSERT_EQUAL_INT16(soccer.tuning->blind_turn_mm_s,
                                wheels.right_mm_s > 0 ? wheels.right_mm_s : wheels.left_mm_s);
    }
}

static void wheels_that_are_off_do_not_count_as_stuck(void)
{
    strategy_event_t event;

    stand_at(0, 0, 0);
    see_nothing(SOCCER_DARK_SEARCH_TICKS - 2u);
    while (soccer_take_event(&soccer, &event))
        TEST_ASSERT_NOT_EQUAL(STRATEGY_WHEELS_BLOCKED, event.reason);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(in_the_open_eyes_that_see_nothing_stop_the_motors);
    RUN_TEST(close_before_a_wall_they_do_not_stop_them);
    RUN_TEST(after_a_second_there_it_turns_away_at_once);
    RUN_TEST(wheels_that_are_off_do_not_count_as_stuck);
    return UNITY_END();
}
