// sources: host-tests/common/vision/painted_scene.c
/* The opponent detector on painted stripes, flat ones: place, disparity, look-alikes. A flat strip
 * bends by nothing, so the correction for a round body shows: at most a quarter of a pixel here. */
#include <string.h>
#include <unity.h>

#include "painted_scene.h"
#include "vision/opponent.h"

#define ROW 80

static band_t band;
static report_t report;
static opponent_extent_t extent;

void setUp(void)
{
    scene_clear(0);
}

void tearDown(void) {}

static void look(void)
{
    memset(&report, 0, sizeof report);
    band_load(&band, &scene_frames, ROW, &eye_params_default);
    opponent_find(&band, &eye_params_default, &report, &extent);
}

/* Seven stripes over the 60 mm of the body at disparity d. */
static int32_t stripe_q4(int32_t d_q4)
{
    return d_q4 * 600 / 504 / 7;
}

static void place_and_disparity_between_pixels(void)
{
    int32_t d_q4;

    for (d_q4 = 22 * 16; d_q4 < 70 * 16; d_q4 += 83) {
        int32_t width_q4 = 7 * stripe_q4(d_q4);

        scene_clear(0);
        scene_stripes(1203, stripe_q4(d_q4), 7, 40, 140, d_q4);
        look();
        TEST_ASSERT_EQUAL_HEX16(REPORT_OPPONENT, report.flags);
        TEST_ASSERT_INT32_WITHIN(16, 1203 + width_q4 / 2, report.opponent_x_q4);
        TEST_ASSERT_INT32_WITHIN(8 + d_q4 / 40, d_q4, report.opponent_disparity_q4);
        TEST_ASSERT_GREATER_THAN_UINT8(3, report.opponent_confidence);
        TEST_ASSERT_EQUAL_UINT8(1, extent.seen);
        /* What it may cover: all of it and up to a sixth more, and 3 px. */
        TEST_ASSERT_INT32_WITHIN(width_q4 / 6 + 64, 1203 - 32, extent.first_q4);
        TEST_ASSERT_TRUE(extent.first_q4 < 1203);
        TEST_ASSERT_TRUE(extent.last_q4 > 1203 + width_q4);
    }
}

static void before_the_goal_too(void)
{
    scene_bar(PAINT_BLACK, 700, 2900, 30, 95, 22 * 16);
    scene_stripes(1600, stripe_q4(30 * 16), 7, 40, 140, 30 * 16);
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_OPPONENT, report.flags);
    TEST_ASSERT_INT32_WITHIN(20, 30 * 16, report.opponent_disparity_q4);
}

static void beside_the_goals_edge_too(void)
{
    scene_bar(PAINT_BLACK, 700, 2300, 30, 95, 17 * 16);
    scene_stripes(1700, stripe_q4(30 * 16), 7, 40, 140, 30 * 16);
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_OPPONENT, report.flags);
    TEST_ASSERT_INT32_WITHIN(20, 30 * 16, report.opponent_disparity_q4);
    /* Its black ends are lost in the goal's black: the middle may be off by a stripe. */
    TEST_ASSERT_INT32_WITHIN(stripe_q4(30 * 16), 1700 + 7 * stripe_q4(30 * 16) / 2,
                             report.opponent_x_q4);
}

static void wall_goal_and_ball_are_no_opponent(void)
{
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
    TEST_ASSERT_EQUAL_UINT8(0, extent.seen);
    scene_bar(PAINT_BLACK, 700, 2900, 30, 95, 22 * 16);
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
    scene_disc(PAINT_YELLOW, 1500, 85 * 16, 14 * 16, 20 * 16);
    scene_disc(PAINT_YELLOW, 2200, 85 * 16, 14 * 16, 20 * 16);
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
}

static void a_body_too_near_to_match_is_still_known_to_be_there(void)
{
    scene_stripes(1200, 17 * 16, 7, 10, 200, 105 * 16);
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
    TEST_ASSERT_EQUAL_UINT8(1, extent.seen);
}

static void noise_gain_and_misaligned_eyes_move_it_little(void)
{
    uint32_t seed;

    for (seed = 1; seed <= 8; seed++) {
        scene_clear(seed & 1 ? 2 : -2);
        scene_stripes(1203, stripe_q4(560), 7, 40, 140, 560);
        scene_gain(EYE_LEFT, 90);
        scene_gain(EYE_RIGHT, 60);
        scene_noise(EYE_LEFT, 10, seed);
        scene_noise(EYE_RIGHT, 10, seed + 50);
        look();
        TEST_ASSERT_EQUAL_HEX16(REPORT_OPPONENT, report.flags);
        TEST_ASSERT_INT32_WITHIN(20, 560, report.opponent_disparity_q4);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(place_and_disparity_between_pixels);
    RUN_TEST(before_the_goal_too);
    RUN_TEST(beside_the_goals_edge_too);
    RUN_TEST(wall_goal_and_ball_are_no_opponent);
    RUN_TEST(a_body_too_near_to_match_is_still_known_to_be_there);
    RUN_TEST(noise_gain_and_misaligned_eyes_move_it_little);
    return UNITY_END();
}
