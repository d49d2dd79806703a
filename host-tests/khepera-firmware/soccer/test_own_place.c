// sources: khepera-firmware/soccer/angle.c khepera-firmware/soccer/odometry.c
// sources: khepera-firmware/soccer/own_place.c khepera-firmware/soccer/tuning.c
// includes: khepera-firmware
/* What the foot of the wall tells of the own place; the robot's true pose is the test's. */
#include "soccer/own_place.h"

#include <math.h>
#include <string.h>
#include <unity.h>

#define PI 3.14159265358979

static own_place_t own;
static pose_t believed;
static place_t feet[REPORT_WALL_COLUMNS];
static double true_x, true_y, true_heading;

void setUp(void)
{
    memset(feet, 0, sizeof feet);
    own_place_start(&own, &soccer_tuning_default);
}

void tearDown(void) {}

static void stand_at(double x, double y, double heading_deg)
{
    true_x = x;
    true_y = y;
    true_heading = heading_deg * PI / 180;
}

static void believe(double x, double y, double heading_deg)
{
    believed.x_q4 = (int32_t)lround(x * 16);
    believed.y_q4 = (int32_t)lround(y * 16);
    believed.heading = angle_wrap((int32_t)lround(heading_deg * 65536 / 360));
}

/* A foot that the middle or an outer column sees at this bearing, on the nearer of the pitch's
 * walls. */
static void look_at_wall(unsigned column, double bearing_deg)
{
    double direction = true_heading + bearing_deg * PI / 180;
    double way_x = (copysign(525, cos(direction)) - true_x) / cos(direction);
    double way_y = (copysign(340, sin(direction)) - true_y) / sin(direction);
    double way = fmin(way_x, way_y);

    feet[column].valid = 1;
    feet[column].forward_mm = (int16_t)lround(way * cos(bearing_deg * PI / 180));
    feet[column].left_mm = (int16_t)lround(way * sin(bearing_deg * PI / 180));
    feet[column].sigma_mm = 4;
}

static void look_around(int frames)
{
    for (; frames > 0; frames--) {
        pose_t change;

        look_at_wall(0, 20);
        look_at_wall(1, 0.01);
        look_at_wall(2, -20);
        if (!own_place_see_walls(&own, &soccer_tuning_default, feet, &believed, &change))
            continue;
        believed.x_q4 += change.x_q4;
        believed.y_q4 += change.y_q4;
        believed.heading = angle_wrap(believed.heading + change.heading);
    }
}

static void a_wall_tells_the_heading_and_the_distance_from_it(void)
{
    own.localised = 1;
    own.position_var[0] = own.position_var[1] = 400;
    own_place_blur(&own, 0, 728L * 728 / 16);
    stand_at(100, 60, 0);
    believe(115, 60, 6);
    look_around(20);
    TEST_ASSERT_INT_WITHIN(4 * 16, 100 * 16, believed.x_q4);
    TEST_ASSERT_INT_WITHIN(ANGLE_DEGREES(1), 0, believed.heading);
    /* Along the wall it says nothing. */
    TEST_ASSERT_INT_WITHIN(10 * 16, 60 * 16, believed.y_q4);
    TEST_ASSERT_TRUE(own.position_var[0] < 100);
}

static void two_walls_tell_the_place_at_kick_off(void)
{
    stand_at(-350, 150, 20);
    believe(-262, 0, 20);
    look_around(10);
    stand_at(-350, 150, 90);
    believed.heading = angle_wrap(believed.heading + ANGLE_DEGREES(70));
    look_around(10);
    stand_at(-350, 150, 180);
    believed.heading = angle_wrap(believed.heading + ANGLE_DEGREES(90));
    look_around(10);
    TEST_ASSERT_INT_WITHIN(10 * 16, -350 * 16, believed.x_q4);
    TEST_ASSERT_INT_WITHIN(10 * 16, 150 * 16, believed.y_q4);
    TEST_ASSERT_TRUE(own.localised);
}

static void a_thing_before_the_wall_moves_nothing(void)
{
    own.localised = 1;
    own.position_var[0] = own.position_var[1] = 100;
    stand_at(100, 60, 0);
    believe(100, 60, 0);
    look_at_wall(1, 0.01);
    feet[1].forward_mm = 200;
    {
        pose_t change;

        TEST_ASSERT_FALSE(
            own_place_see_walls(&own, &soccer_tuning_default, feet, &believed, &change));
    }
    TEST_ASSERT_EQUAL_INT32(100, own.position_var[0]);
}

static void walls_where_none_should_be_raise_doubts(void)
{
    int32_t before;

    own.localised = 1;
    own.position_var[0] = own.position_var[1] = 100;
    stand_at(-100, 60, 0);
    believe(200, 60, 0);
    before = own.heading_var;
    look_around(1);
    TEST_ASSERT_TRUE(own.position_var[0] > 100);
    TEST_ASSERT_TRUE(own.heading_var > before);
    TEST_ASSERT_EQUAL_UINT8(1, own.doubts);
}

static void turning_and_driving_make_it_less_certain(void)
{
    static const int32_t turns[2] = {-100, 100};
    int32_t heading_var = own.heading_var;
    unsigned i;

    for (i = 0; i < 50; i++)
        own_place_travel(&own, turns);
    TEST_ASSERT_TRUE(own.heading_var > heading_var);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_wall_tells_the_heading_and_the_distance_from_it);
    RUN_TEST(two_walls_tell_the_place_at_kick_off);
    RUN_TEST(a_thing_before_the_wall_moves_nothing);
    RUN_TEST(walls_where_none_should_be_raise_doubts);
    RUN_TEST(turning_and_driving_make_it_less_certain);
    return UNITY_END();
}
