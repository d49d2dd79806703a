// sources: khepera-firmware/soccer/angle.c khepera-firmware/soccer/odometry.c
// sources: khepera-firmware/soccer/world.c khepera-firmware/soccer/own_place.c
// sources: khepera-firmware/soccer/strategy.c khepera-firmware/soccer/tuning.c
// includes: khepera-firmware
/* Single decisions in worlds made by hand; whole matches are in test_play.c. */
#include "soccer/strategy.h"

#include <string.h>
#include <unity.h>

static world_t world;
static strategy_t strategy;
static wheels_t wheels;

static void stand_at(int32_t x_mm, int32_t y_mm, int32_t heading_deg)
{
    pose_t pose = {16 * x_mm, 16 * y_mm, angle_from_degrees(heading_deg)};

    odometry_set(&world.odometry, &pose);
}

static void put(object_t *object, int32_t x_mm, int32_t y_mm)
{
    memset(object, 0, sizeof *object);
    object->known = 1;
    object->x_q4 = 16 * x_mm;
    object->y_q4 = 16 * y_mm;
}

static strategy_state_t decide(void)
{
    strategy_decide(&strategy, &world, &wheels);
    return strategy.state;
}

/* Ticks with wheels that turn as told (`percent` of it). */
static void pass(unsigned ticks, int32_t percent)
{
    for (; ticks > 0; ticks--) {
        int32_t counts[2] = {strategy.wheels.left_mm_s * 12 * percent / 10000,
                             strategy.wheels.right_mm_s * 12 * percent / 10000};

        strategy_tick(&strategy, counts);
        (void)decide();
    }
}

void setUp(void)
{
    world_start(&world, &soccer_tuning_default, 0);
    strategy_start(&strategy, &soccer_tuning_default);
    world.own.localised = 1;
    stand_at(-200, 0, 0);
}

void tearDown(void) {}

static void every_state_has_a_name(void)
{
    unsigned state;

    for (state = 0; state < STRATEGY_STATE_COUNT; state++)
        TEST_ASSERT_TRUE(strcmp("unknown", strategy_state_name((strategy_state_t)state)) != 0);
    TEST_ASSERT_EQUAL_STRING("unknown", strategy_state_name(STRATEGY_STATE_COUNT));
}

static void without_a_ball_it_turns_on_the_spot(void)
{
    TEST_ASSERT_EQUAL(STRATEGY_SEARCH, decide());
    TEST_ASSERT_EQUAL_INT16(-wheels.left_mm_s, wheels.right_mm_s);
    TEST_ASSERT_TRUE(wheels.right_mm_s != 0);
}

static void a_lost_ball_is_searched_where_it_was_last(void)
{
    put(&world.ball, 100, -200);
    world.last_ball_bearing = angle_from_degrees(-40);
    (void)decide();
    world.ball.known = 0;
    TEST_ASSERT_EQUAL(STRATEGY_SEARCH, decide());
    TEST_ASSERT_TRUE_MESSAGE(wheels.left_mm_s > wheels.right_mm_s, "turns right");
}

static void with_eyes_that_see_nothing_it_stays_where_it_is(void)
{
    unsigned tick;

    world.own.localised = 0;
    for (tick = 0; tick < 6000; tick++) {
        pass(1, 100);
        TEST_ASSERT_EQUAL_INT16(-wheels.left_mm_s, wheels.right_mm_s);
    }
}

static void a_viewpoint_never_lies_far_forward(void)
{
    int32_t x;
    int32_t y;

    for (x = -450; x <= 450; x += 50) {
        for (y = -300; y <= 300; y += 50) {
            strategy_start(&strategy, &soccer_tuning_default);
            stand_at(x, y, 30);
            put(&world.opponent, 200, 10);
            pass(402, 100);
            TEST_ASSERT_EQUAL(STRATEGY_RELOCATE, strategy.state);
            TEST_ASSERT_TRUE(strategy.view_x_q4 / 16 <= x + 70);
        }
    }
}

static void not_knowing_its_place_it_looks_for_a_goal_first(void)
{
    world.own.localised = 0;
    put(&world.ball, 0, 0);
    TEST_ASSERT_EQUAL(STRATEGY_LOOK, decide());
    TEST_ASSERT_EQUAL_INT16(-wheels.left_mm_s, wheels.right_mm_s);
    world.own.localised = 1;
    (void)decide();
    TEST_ASSERT_TRUE(strategy.state == STRATEGY_APPROACH || strategy.state == STRATEGY_PUSH);
}

static void behind_the_ball_it_pushes(void)
{
    put(&world.ball, 0, 0);
    stand_at(-150, 0, 0);
    (void)decide();
    TEST_ASSERT_EQUAL(STRATEGY_PUSH, decide());
    TEST_ASSERT_TRUE(wheels.left_mm_s > 200 && wheels.right_mm_s > 200);
}

static void before_the_ball_it_drives_around_it(void)
{
    put(&world.ball, 0, 0);
    stand_at(150, 0, 180);
    TEST_ASSERT_EQUAL(STRATEGY_APPROACH, decide());
    TEST_ASSERT_TRUE(strategy.around != 0);
    TEST_ASSERT_TRUE(wheels.left_mm_s != wheels.right_mm_s);
}

static void near_a_wall_it_goes_around_the_free_side(void)
{
    put(&world.ball, 0, -220);
    stand_at(130, -230, 180);
    (void)decide();
    TEST_ASSERT_EQUAL_INT8(-1, strategy.around);
    stand_at(130, -150, 180);
    strategy.around = 0;
    (void)decide();
    TEST_ASSERT_EQUAL_INT8(-1, strategy.around);
}

static void the_shot_misses_an_opponent_in_the_way(void)
{
    put(&world.ball, 150, 0);
    (void)decide();
    TEST_ASSERT_INT_WITHIN(ANGLE_DEGREES(4), 0, strategy.shot);
    put(&world.opponent, 400, 0);
    strategy_start(&strategy, &soccer_tuning_default);
    (void)decide();
    TEST_ASSERT_TRUE(strategy.shot > ANGLE_DEGREES(10) || strategy.shot < ANGLE_DEGREES(-10));
}

static void no_shot_goes_towards_the_own_goal(void)
{
    int32_t x;
    int32_t y;

    for (x = -480; x <= 480; x += 40) {
        for (y = -300; y <= 300; y += 30) {
            strategy_start(&strategy, &soccer_tuning_default);
            put(&world.ball, x, y);
            stand_at(x < 0 ? x + 120 : x - 120, y / 2, 0);
            (void)decide();
            TEST_ASSERT_TRUE(angle_cos_q14(strategy.shot) > -5000);
        }
    }
}

static void wheels_that_stand_still_make_it_back_off(void)
{
    put(&world.ball, 0, 0);
    stand_at(-150, 0, 0);
    (void)decide();
    pass(60, 0);
    TEST_ASSERT_EQUAL(STRATEGY_BACK_OFF, strategy.state);
    TEST_ASSERT_TRUE(wheels.left_mm_s < 0 && wheels.right_mm_s < 0);
    pass(90, 100);
    TEST_ASSERT_TRUE(strategy.state != STRATEGY_BACK_OFF);
}

static void a_ball_that_is_not_where_it_should_be_is_forgotten(void)
{
    put(&world.ball, 0, 0);
    (void)decide();
    world.ball.unseen_ticks = 100;
    TEST_ASSERT_EQUAL(STRATEGY_SEARCH, decide());
    TEST_ASSERT_FALSE(world.ball.known);
}

static void every_reason_has_a_name(void)
{
    unsigned reason;

    for (reason = 0; reason < STRATEGY_REASON_COUNT; reason++)
        TEST_ASSERT_TRUE(strcmp("unknown", strategy_reason_name((strategy_reason_t)reason)) != 0);
    TEST_ASSERT_EQUAL_STRING("unknown", strategy_reason_name(STRATEGY_REASON_COUNT));
}

static void each_change_of_state_is_told_with_its_reason(void)
{
    strategy_event_t event;

    TEST_ASSERT_FALSE(strategy_take_event(&strategy, &event));
    put(&world.ball, 0, 0);
    stand_at(150, 0, 180);
    (void)decide();
    TEST_ASSERT_TRUE(strategy_take_event(&strategy, &event));
    TEST_ASSERT_EQUAL(STRATEGY_SEARCH, event.from);
    TEST_ASSERT_EQUAL(STRATEGY_APPROACH, event.to);
    TEST_ASSERT_EQUAL(STRATEGY_BALL_FOUND, event.reason);
    world.ball.known = 0;
    (void)decide();
    TEST_ASSERT_TRUE(strategy_take_event(&strategy, &event));
    TEST_ASSERT_EQUAL(STRATEGY_BALL_LOST, event.reason);
    TEST_ASSERT_FALSE(strategy_take_event(&strategy, &event));
}

static void changes_that_nobody_takes_are_lost_oldest_first(void)
{
    strategy_event_t event;
    unsigned i;

    put(&world.ball, 0, 0);
    stand_at(150, 0, 180);
    for (i = 0; i < STRATEGY_EVENTS + 3; i++) {
        world.ball.known = i % 2 == 0;
        (void)decide();
    }
    TEST_ASSERT_EQUAL_UINT16(3, strategy.events_lost);
    for (i = 0; i < STRATEGY_EVENTS; i++)
        TEST_ASSERT_TRUE(strategy_take_event(&strategy, &event));
    TEST_ASSERT_FALSE(strategy_take_event(&strategy, &event));
    TEST_ASSERT_EQUAL(strategy.state, event.to);
}

static void an_opponent_nearer_to_the_ball_makes_it_defend(void)
{
    put(&world.ball, -100, 100);
    put(&world.opponent, 0, 160);
    stand_at(300, 0, 180);
    TEST_ASSERT_EQUAL(STRATEGY_DEFEND, decide());
    /* Between ball and own goal it attacks instead, whoever is nearer. */
    stand_at(-300, -20, 0);
    TEST_ASSERT_EQUAL(STRATEGY_APPROACH, decide());
    /* And an opponent not seen for long does not count. */
    stand_at(300, 0, 180);
    world.opponent.age_ticks = 300;
    TEST_ASSERT_EQUAL(STRATEGY_APPROACH, decide());
}

static void a_ball_lost_while_pushing_is_searched(void)
{
    put(&world.ball, 0, 0);
    stand_at(-150, 0, 0);
    (void)decide();
    TEST_ASSERT_EQUAL(STRATEGY_PUSH, decide());
    world.ball.age_ticks = 60;
    pass(20, 100);
    TEST_ASSERT_EQUAL_MESSAGE(STRATEGY_PUSH, strategy.state, "at first it goes on blindly");
    pass(60, 100);
    TEST_ASSERT_EQUAL(STRATEGY_SEARCH, strategy.state);
    TEST_ASSERT_FALSE(world.ball.known);
}

/* The opponent presses a ball into the corner: nobody gets it out, the referee puts it on a spot.
 */
static void a_pinned_ball_is_awaited_behind_the_free_balls_spot(void)
{
    put(&world.ball, 480, 280);
    stand_at(100, 0, 0);
    (void)decide();
    put(&world.opponent, 430, 240);
    pass(100, 100);
    TEST_ASSERT_NOT_EQUAL_MESSAGE(STRATEGY_AWAIT, strategy.state, "it may still come out");
    pass(100, 100);
    TEST_ASSERT_EQUAL(STRATEGY_AWAIT, strategy.state);
    /* On the line from the spot (262, 170) to the goal, behind it, it stands and faces the spot. */
    stand_at(262 - 123, 170 + 67, -28);
    (void)decide();
    TEST_ASSERT_INT_WITHIN(20, 0, wheels.left_mm_s);
    TEST_ASSERT_INT_WITHIN(20, 0, wheels.right_mm_s);
    /* There it is. */
    put(&world.ball, 262, 170);
    (void)decide();
    (void)decide();
    TEST_ASSERT_EQUAL(STRATEGY_PUSH, strategy.state);
}

static void a_ball_that_moves_is_not_awaited(void)
{
    int i;

    stand_at(100, 0, 0);
    put(&world.opponent, 430, 240);
    for (i = 0; i < 40; i++) {
        put(&world.ball, 400 - 70 * (i % 2), 280);
        pass(10, 100);
        TEST_ASSERT_NOT_EQUAL(STRATEGY_AWAIT, strategy.state);
    }
}

static void changed_parameters_count_at_once(void)
{
    soccer_tuning_t tuning = soccer_tuning_default;

    strategy_start(&strategy, &tuning);
    (void)decide();
    TEST_ASSERT_EQUAL_INT16(tuning.search_turn_mm_s, wheels.right_mm_s);
    tuning.search_turn_mm_s = 33;
    (void)decide();
    TEST_ASSERT_EQUAL_INT16(33, wheels.right_mm_s);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(every_state_has_a_name);
    RUN_TEST(without_a_ball_it_turns_on_the_spot);
    RUN_TEST(a_lost_ball_is_searched_where_it_was_last);
    RUN_TEST(with_eyes_that_see_nothing_it_stays_where_it_is);
    RUN_TEST(a_viewpoint_never_lies_far_forward);
    RUN_TEST(not_knowing_its_place_it_looks_for_a_goal_first);
    RUN_TEST(behind_the_ball_it_pushes);
    RUN_TEST(before_the_ball_it_drives_around_it);
    RUN_TEST(near_a_wall_it_goes_around_the_free_side);
    RUN_TEST(the_shot_misses_an_opponent_in_the_way);
    RUN_TEST(no_shot_goes_towards_the_own_goal);
    RUN_TEST(wheels_that_stand_still_make_it_back_off);
    RUN_TEST(a_ball_that_is_not_where_it_should_be_is_forgotten);
    RUN_TEST(every_reason_has_a_name);
    RUN_TEST(each_change_of_state_is_told_with_its_reason);
    RUN_TEST(changes_that_nobody_takes_are_lost_oldest_first);
    RUN_TEST(an_opponent_nearer_to_the_ball_makes_it_defend);
    RUN_TEST(a_ball_lost_while_pushing_is_searched);
    RUN_TEST(a_pinned_ball_is_awaited_behind_the_free_balls_spot);
    RUN_TEST(a_ball_that_moves_is_not_awaited);
    RUN_TEST(changed_parameters_count_at_once);
    return UNITY_END();
}
