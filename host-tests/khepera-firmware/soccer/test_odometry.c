// sources: khepera-firmware/soccer/angle.c khepera-firmware/soccer/odometry.c
// includes: khepera-firmware
/* Odometry against exact arcs. */
#include "soccer/odometry.h"

#include <math.h>
#include <unity.h>

#define PI 3.14159265358979

static odometry_t odometry;
static pose_t pose;

void setUp(void)
{
    static const pose_t origin = {0, 0, 0};

    odometry_set(&odometry, &origin);
}

void tearDown(void) {}

static void a_straight_metre_is_a_metre(void)
{
    int i;

    for (i = 0; i < 400; i++)
        odometry_add(&odometry, 30, 30);
    odometry_pose(&odometry, &pose);
    TEST_ASSERT_INT_WITHIN(2, 1000 * 16, pose.x_q4);
    TEST_ASSERT_INT_WITHIN(1, 0, pose.y_q4);
    TEST_ASSERT_EQUAL_INT(0, pose.heading);
}

static void ten_turns_on_the_spot_end_where_they_began(void)
{
    /* One turn: 2 pi * 53 mm of difference = 3996.11 counts. */
    int32_t counts = (int32_t)lround(10 * 2 * PI * 53 * 12 / 2);
    int32_t i;

    for (i = 0; i < counts; i++)
        odometry_add(&odometry, -1, 1);
    odometry_pose(&odometry, &pose);
    TEST_ASSERT_INT_WITHIN(ANGLE_DEGREES(1) / 10, 0, pose.heading);
    TEST_ASSERT_INT_WITHIN(1, 0, pose.x_q4);
    TEST_ASSERT_INT_WITHIN(1, 0, pose.y_q4);
}

static void an_arc_ends_where_geometry_says(void)
{
    /* 36 and 30 counts a tick: radius 53/2 * 66/6 mm, 6/636 rad a tick. */
    double radius = 53.0 / 2 * 66 / 6;
    double angle = 100 * 6 / 636.0;
    int i;

    for (i = 0; i < 100; i++)
        odometry_add(&odometry, 30, 36);
    odometry_pose(&odometry, &pose);
    TEST_ASSERT_INT_WITHIN(8, lround(16 * radius * sin(angle)), pose.x_q4);
    TEST_ASSERT_INT_WITHIN(8, lround(16 * radius * (1 - cos(angle))), pose.y_q4);
    TEST_ASSERT_INT_WITHIN(20, lround(angle * 32768 / PI), pose.heading);
}

static void a_runaway_saturates_instead_of_wrapping(void)
{
    int i;

    for (i = 0; i < 1000; i++)
        odometry_add(&odometry, 1000, 1000);
    odometry_pose(&odometry, &pose);
    TEST_ASSERT_INT_WITHIN(16, 2000 * 16, pose.x_q4);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_straight_metre_is_a_metre);
    RUN_TEST(ten_turns_on_the_spot_end_where_they_began);
    RUN_TEST(an_arc_ends_where_geometry_says);
    RUN_TEST(a_runaway_saturates_instead_of_wrapping);
    return UNITY_END();
}
