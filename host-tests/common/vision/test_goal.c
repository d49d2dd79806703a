// sources: host-tests/common/vision/painted_scene.c
/* The goal detector on painted goals: both edges, one, none, hidden ones, unequal eyes. */
#include <string.h>
#include <unity.h>

#include "painted_scene.h"
#include "vision/goal.h"

#define ROW        60
#define BOTH_EDGES (REPORT_GOAL_LEFT_EDGE | REPORT_GOAL_RIGHT_EDGE)

static band_t band;
static report_t report;
static opponent_extent_t opponent;

void setUp(void)
{
    scene_clear(0);
    memset(&opponent, 0, sizeof opponent);
}

void tearDown(void) {}

static void look(void)
{
    memset(&report, 0, sizeof report);
    band_load(&band, &scene_frames, ROW, &eye_params_default);
    goal_find(&band, &eye_params_default, &opponent, &report);
}

/* A goal seen head-on at disparity d is 300/50.4 of it wide. */
static int32_t paint_goal(int32_t x0_q4, int32_t d_q4)
{
    int32_t x1_q4 = x0_q4 + d_q4 * 3000 / 504;

    scene_bar(PAINT_BLACK, x0_q4, x1_q4, 40, 95, d_q4);
    return x1_q4;
}

static void both_edges_are_placed_between_pixels(void)
{
    int32_t d_q4;

    for (d_q4 = 230; d_q4 < 600; d_q4 += 37) {
        int32_t x1_q4;

        scene_clear(0);
        x1_q4 = paint_goal(405, d_q4);
        look();
        TEST_ASSERT_EQUAL_HEX16(BOTH_EDGES, report.flags);
        TEST_ASSERT_INT32_WITHIN(4, 405, report.goal_x_q4[0]);
        TEST_ASSERT_INT32_WITHIN(4, x1_q4, report.goal_x_q4[1]);
        TEST_ASSERT_INT32_WITHIN(4, d_q4, report.goal_disparity_q4[0]);
        TEST_ASSERT_INT32_WITHIN(4, d_q4, report.goal_disparity_q4[1]);
        TEST_ASSERT_GREATER_THAN_UINT8(7, report.goal_confidence);
    }
}

static void an_edge_out_of_the_picture_is_not_reported(void)
{
    paint_goal(-800, 352);
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_GOAL_RIGHT_EDGE, report.flags);
    TEST_ASSERT_INT32_WITHIN(4, 352, report.goal_disparity_q4[1]);
    TEST_ASSERT_EQUAL_UINT16(0, report.goal_x_q4[0]);
    TEST_ASSERT_EQUAL_UINT16(0, report.goal_disparity_q4[0]);

    scene_clear(0);
    paint_goal(3600, 352);
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_GOAL_LEFT_EDGE, report.flags);
}

static void a_wall_without_goal_has_none(void)
{
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
    scene_bar((paint_t){60, 60, 60}, 2000, 5200, 0, 99, 300); /* the next wall, in shade */
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
}

static void a_goal_that_fills_the_picture_has_no_edges(void)
{
    paint_goal(-2000, 1200);
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
}

static void the_opponent_alone_is_no_goal(void)
{
    scene_stripes(1600, 12 * 16, 7, 30, 150, 51 * 16);
    opponent.seen = 1;
    opponent.first_q4 = 1600 - 48;
    opponent.last_q4 = 1600 + 7 * 12 * 16 + 48;
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
}

static void an_edge_behind_the_opponent_is_not_reported(void)
{
    int32_t x1_q4 = paint_goal(1000, 320);

    scene_stripes(700, 7 * 16, 6, 30, 150, 30 * 16);
    opponent.seen = 1;
    opponent.first_q4 = 700 - 48;
    opponent.last_q4 = 700 + 6 * 7 * 16 + 48;
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_GOAL_RIGHT_EDGE, report.flags);
    TEST_ASSERT_INT32_WITHIN(4, x1_q4, report.goal_x_q4[1]);
    TEST_ASSERT_INT32_WITHIN(4, 320, report.goal_disparity_q4[1]);
}

static void the_opponent_inside_the_goal_hides_no_edge(void)
{
    int32_t x1_q4 = paint_goal(600, 384);

    scene_stripes(1500, 5 * 16, 6, 30, 150, 26 * 16);
    opponent.seen = 1;
    opponent.first_q4 = 1500 - 48;
    opponent.last_q4 = 1500 + 6 * 5 * 16 + 48;
    look();
    TEST_ASSERT_EQUAL_HEX16(BOTH_EDGES, report.flags);
    TEST_ASSERT_INT32_WITHIN(4, 600, report.goal_x_q4[0]);
    TEST_ASSERT_INT32_WITHIN(4, x1_q4, report.goal_x_q4[1]);
}

static void noise_gain_and_misaligned_eyes_move_it_little(void)
{
    uint32_t seed;

    for (seed = 1; seed <= 8; seed++) {
        scene_clear(seed & 1 ? 2 : -2);
        paint_goal(900, 300);
        scene_gain(EYE_LEFT, 90);
        scene_gain(EYE_RIGHT, 72);
        scene_noise(EYE_LEFT, 10, seed);
        scene_noise(EYE_RIGHT, 10, seed + 50);
        look();
        TEST_ASSERT_EQUAL_HEX16(BOTH_EDGES, report.flags);
        TEST_ASSERT_INT32_WITHIN(10, 300, report.goal_disparity_q4[0]);
        TEST_ASSERT_INT32_WITHIN(10, 300, report.goal_disparity_q4[1]);
    }
}

static void edges_too_near_for_the_search_range_are_not_reported(void)
{
    paint_goal(1600, 90 * 16);
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(both_edges_are_placed_between_pixels);
    RUN_TEST(an_edge_out_of_the_picture_is_not_reported);
    RUN_TEST(a_wall_without_goal_has_none);
    RUN_TEST(a_goal_that_fills_the_picture_has_no_edges);
    RUN_TEST(the_opponent_alone_is_no_goal);
    RUN_TEST(an_edge_behind_the_opponent_is_not_reported);
    RUN_TEST(the_opponent_inside_the_goal_hides_no_edge);
    RUN_TEST(noise_gain_and_misaligned_eyes_move_it_little);
    RUN_TEST(edges_too_near_for_the_search_range_are_not_reported);
    return UNITY_END();
}
