// sources: khepera-firmware/soccer/angle.c khepera-firmware/soccer/odometry.c
// sources: khepera-firmware/soccer/world.c khepera-firmware/soccer/own_place.c
// sources: khepera-firmware/soccer/tuning.c
// includes: khepera-firmware
/* What the world model makes of sightings; the robot's true pose is the test's. */
#include "soccer/world.h"

#include <math.h>
#include <string.h>
#include <unity.h>

#define PI  3.14159265358979
#define AGE 300 /* 30 ms, in units of 100 us */
#define STANDS                                                                                     \
    {                                                                                              \
        0, 0                                                                                       \
    }

static world_t world;
static sightings_t seen;
static double true_x, true_y, true_heading;

void setUp(void)
{
    memset(&seen, 0, sizeof seen);
    true_x = -200;
    true_y = 40;
    true_heading = 0;
    world_start(&world, &soccer_tuning_default, 0);
}

void tearDown(void) {}

static angle_t angle_from_radians(double radians)
{
    return angle_wrap((int32_t)lround(radians * 32768 / PI));
}

static void look_at(place_t *place, double x, double y, uint16_t sigma_mm)
{
    double dx = x - true_x;
    double dy = y - true_y;

    place->valid = 1;
    place->forward_mm = (int16_t)lround(dx * cos(true_heading) + dy * sin(true_heading));
    place->left_mm = (int16_t)lround(-dx * sin(true_heading) + dy * cos(true_heading));
    place->sigma_mm = sigma_mm;
}

static void look_at_goal(double side)
{
    look_at(&seen.goal_edge[0], side * 525, side * 150, 10);
    look_at(&seen.goal_edge[1], side * 525, -side * 150, 10);
}

static void stand(int ticks)
{
    static const int32_t counts[2] = STANDS;

    for (; ticks > 0; ticks--)
        world_tick(&world, counts);
}

static void see_for(int frames)
{
    for (; frames > 0; frames--) {
        stand(2);
        world_see(&world, &seen, AGE);
    }
}

static pose_t believed(void)
{
    pose_t pose;

    odometry_pose(&world.odometry, &pose);
    return pose;
}

static void the_opponents_goal_tells_the_place(void)
{
    TEST_ASSERT_FALSE(world.own.localised);
    look_at_goal(1);
    see_for(20);
    TEST_ASSERT_TRUE(world.own.localised);
    TEST_ASSERT_INT_WITHIN(8, -200, believed().x_q4 / 16);
    TEST_ASSERT_INT_WITHIN(8, 40, believed().y_q4 / 16);
    TEST_ASSERT_TRUE(world_position_sigma_mm(&world) < 30);
}

static void the_own_goal_is_told_by_the_heading(void)
{
    true_heading = PI - 0.1;
    world_start(&world, &soccer_tuning_default, angle_from_radians(true_heading));
    look_at_goal(-1);
    see_for(20);
    TEST_ASSERT_TRUE(world.own.localised);
    TEST_ASSERT_INT_WITHIN(8, -200, believed().x_q4 / 16);
    TEST_ASSERT_INT_WITHIN(8, 40, believed().y_q4 / 16);
}

static void a_wrong_heading_is_put_right_by_the_goal(void)
{
    true_heading = 3 * PI / 180;
    look_at_goal(1);
    seen.goal_edge[0].sigma_mm = 4;
    seen.goal_edge[1].sigma_mm = 4;
    see_for(60);
    TEST_ASSERT_INT_WITHIN(ANGLE_DEGREES(1), angle_from_radians(true_heading), believed().heading);
}

static void a_goal_that_would_put_it_off_the_pitch_is_ignored(void)
{
    true_y = 500;
    look_at_goal(1);
    see_for(20);
    TEST_ASSERT_FALSE(world.own.localised);
}

static void once_it_knows_one_strange_post_moves_nothing(void)
{
    pose_t before;

    look_at_goal(1);
    see_for(20);
    before = believed();
    memset(&seen, 0, sizeof seen);
    look_at(&seen.goal_edge[0], 300, 200, 10);
    see_for(1);
    TEST_ASSERT_EQUAL_INT32(before.x_q4, believed().x_q4);
    TEST_ASSERT_EQUAL_INT32(before.y_q4, believed().y_q4);
}

static void after_being_carried_away_it_finds_itself_again(void)
{
    look_at_goal(1);
    see_for(20);
    true_x = 150;
    true_y = -120;
    look_at_goal(1);
    see_for(40);
    TEST_ASSERT_INT_WITHIN(20, 150, believed().x_q4 / 16);
    TEST_ASSERT_INT_WITHIN(20, -120, believed().y_q4 / 16);
}

static void a_correction_carries_the_ball_along(void)
{
    look_at(&seen.ball, 100, 100, 5);
    see_for(5);
    seen.ball.valid = 0;
    look_at_goal(1);
    see_for(20);
    TEST_ASSERT_INT_WITHIN(10, 100, world.ball.x_q4 / 16);
    TEST_ASSERT_INT_WITHIN(10, 100, world.ball.y_q4 / 16);
}

static void a_sighting_counts_from_where_the_robot_was_then(void)
{
    static const int32_t turning[2] = {-8, 8};
    const double per_tick = 16.0 / 636;
    int tick;

    look_at_goal(1);
    see_for(20);
    memset(&seen, 0, sizeof seen);
    /* Exposed at the first tick, told three ticks later. */
    look_at(&seen.ball, 100, 0, 3);
    for (tick = 0; tick < 3; tick++)
        world_tick(&world, turning);
    true_heading += 3 * per_tick;
    world_see(&world, &seen, 300);
    TEST_ASSERT_INT_WITHIN(8, 100, world.ball.x_q4 / 16);
    TEST_ASSERT_INT_WITHIN(8, 0, world.ball.y_q4 / 16);
}

static void one_strange_ball_is_not_believed_three_are(void)
{
    look_at_goal(1);
    look_at(&seen.ball, 100, 100, 5);
    see_for(20);
    look_at(&seen.ball, 100, -200, 5);
    see_for(1);
    TEST_ASSERT_INT_WITHIN(10, 100, world.ball.y_q4 / 16);
    see_for(3);
    TEST_ASSERT_INT_WITHIN(15, -200, world.ball.y_q4 / 16);
}

static void a_ball_beyond_the_wall_is_ignored(void)
{
    look_at_goal(1);
    see_for(20);
    look_at(&seen.ball, 300, 450, 5);
    see_for(5);
    TEST_ASSERT_FALSE(world.ball.known);
}

static void a_rolling_ball_gets_a_speed_and_rolls_on(void)
{
    double x = -50;
    int frame;

    look_at_goal(1);
    see_for(20);
    for (frame = 0; frame < 40; frame++) {
        x += 200 * 0.02;
        /* Seen 30 ms late. */
        look_at(&seen.ball, x - 200 * 0.03, 50, 3);
        see_for(1);
    }
    TEST_ASSERT_INT_WITHIN(60, 200, world.ball.vx_mm_s);
    TEST_ASSERT_INT_WITHIN(12, lround(x), world.ball.x_q4 / 16);
    stand(20);
    TEST_ASSERT_TRUE(world.ball.x_q4 / 16 > x + 10);
}

static void what_should_be_in_view_and_is_not_becomes_doubtful(void)
{
    look_at_goal(1);
    look_at(&seen.ball, 200, 40, 5);
    see_for(20);
    TEST_ASSERT_EQUAL_UINT16(0, world.ball.unseen_ticks);
    seen.ball.valid = 0;
    see_for(15);
    TEST_ASSERT_UINT16_WITHIN(6, 30, world.ball.unseen_ticks);
}

static void what_is_behind_the_robot_does_not(void)
{
    look_at_goal(1);
    see_for(20);
    look_at(&seen.ball, -400, 40, 5);
    see_for(1);
    seen.ball.valid = 0;
    see_for(15);
    TEST_ASSERT_TRUE(world.ball.known);
    TEST_ASSERT_EQUAL_UINT16(0, world.ball.unseen_ticks);
}

static void no_robot_drives_through_a_wall(void)
{
    static const int32_t sideways[2] = {36, 36};
    int tick;

    look_at_goal(1);
    see_for(20);
    world.odometry.heading_q32 = 0x40000000u;
    for (tick = 0; tick < 300; tick++)
        world_tick(&world, sideways);
    TEST_ASSERT_TRUE(believed().y_q4 / 16 <= 340);
    TEST_ASSERT_TRUE(world.wall_ticks > 50);
}

static void what_is_not_seen_gets_older_and_less_certain(void)
{
    sight_t fresh;
    sight_t old;

    look_at_goal(1);
    look_at(&seen.ball, 100, 40, 5);
    see_for(20);
    TEST_ASSERT_TRUE(world_sight(&world, &world.ball, &fresh));
    stand(100);
    TEST_ASSERT_TRUE(world_sight(&world, &world.ball, &old));
    TEST_ASSERT_EQUAL_UINT16(100, world.ball.age_ticks);
    TEST_ASSERT_TRUE(old.range_sigma_mm > fresh.range_sigma_mm + 100);
    TEST_ASSERT_TRUE(old.bearing_sigma > fresh.bearing_sigma);
}

static void range_and_bearing_are_those_from_the_robot(void)
{
    sight_t sight;

    TEST_ASSERT_FALSE(world_sight(&world, &world.ball, &sight));
    TEST_ASSERT_FALSE(world_sight_goal(&world, 1, &sight));
    look_at_goal(1);
    look_at(&seen.ball, 0, 240, 5);
    see_for(20);
    TEST_ASSERT_TRUE(world_sight(&world, &world.ball, &sight));
    TEST_ASSERT_UINT16_WITHIN(4, 283, sight.range_mm);
    TEST_ASSERT_INT_WITHIN(ANGLE_DEGREES(1), ANGLE_DEGREES(45), sight.bearing);
    TEST_ASSERT_TRUE(world_sight_goal(&world, 1, &sight));
    TEST_ASSERT_UINT16_WITHIN(12, 726, sight.range_mm);
    TEST_ASSERT_INT_WITHIN(ANGLE_DEGREES(1), -574, sight.bearing);
    TEST_ASSERT_TRUE(world_sight_goal(&world, -1, &sight));
    TEST_ASSERT_UINT16_WITHIN(12, 327, sight.range_mm);
}

static void a_ball_hidden_by_a_moving_opponent_goes_with_him(void)
{
    double x = 0;
    int frame;

    look_at_goal(1);
    for (frame = 0; frame < 40; frame++) {
        x += 200 * 0.02;
        look_at(&seen.opponent, x - 6, 40, 4);
        if (frame < 20)
            look_at(&seen.ball, x - 6 + 70, 40, 4);
        else
            seen.ball.valid = 0;
        see_for(1);
    }
    TEST_ASSERT_INT_WITHIN(30, lround(x) + 70, world.ball.x_q4 / 16);
}

static void so_close_before_a_wall_the_view_is_blocked(void)
{
    look_at_goal(1);
    see_for(20);
    TEST_ASSERT_FALSE(world_view_is_blocked(&world));
    world.odometry.x_q16 = 420 * 65536;
    TEST_ASSERT_TRUE(world_view_is_blocked(&world));
    /* Along the wall the far one is seen. */
    world.odometry.heading_q32 = 0x40000000u;
    TEST_ASSERT_FALSE(world_view_is_blocked(&world));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_opponents_goal_tells_the_place);
    RUN_TEST(the_own_goal_is_told_by_the_heading);
    RUN_TEST(a_wrong_heading_is_put_right_by_the_goal);
    RUN_TEST(a_goal_that_would_put_it_off_the_pitch_is_ignored);
    RUN_TEST(once_it_knows_one_strange_post_moves_nothing);
    RUN_TEST(after_being_carried_away_it_finds_itself_again);
    RUN_TEST(a_correction_carries_the_ball_along);
    RUN_TEST(a_sighting_counts_from_where_the_robot_was_then);
    RUN_TEST(one_strange_ball_is_not_believed_three_are);
    RUN_TEST(a_ball_beyond_the_wall_is_ignored);
    RUN_TEST(a_rolling_ball_gets_a_speed_and_rolls_on);
    RUN_TEST(what_should_be_in_view_and_is_not_becomes_doubtful);
    RUN_TEST(what_is_behind_the_robot_does_not);
    RUN_TEST(no_robot_drives_through_a_wall);
    RUN_TEST(what_is_not_seen_gets_older_and_less_certain);
    RUN_TEST(range_and_bearing_are_those_from_the_robot);
    RUN_TEST(a_ball_hidden_by_a_moving_opponent_goes_with_him);
    RUN_TEST(so_close_before_a_wall_the_view_is_blocked);
    return UNITY_END();
}
