// sources: khepera-firmware/soccer/angle.c khepera-firmware/soccer/sighting.c
// sources: khepera-firmware/soccer/tuning.c
// includes: khepera-firmware
/* Reports into places, on the published reference scene: ball on the centre spot, seen from
 * (-228, 33) mm with a yaw of -10.6 degrees; goal and opponent beyond. */
#include "soccer/sighting.h"

#include <math.h>
#include <string.h>
#include <unity.h>

#include "vision/camera.h"

static report_t report;
static sightings_t seen;

void setUp(void)
{
    memset(&report, 0, sizeof report);
    report.function = FPGA_FUNCTION_SOCCER;
}

void tearDown(void) {}

/* The reference scene's figures; the disparity of the ball 69.5 px. */
static void reference_scene(void)
{
    report.flags = REPORT_BALL | REPORT_GOAL_LEFT_EDGE | REPORT_GOAL_RIGHT_EDGE | REPORT_OPPONENT;
    report.ball_x_q4 = 146 * 16;
    report.ball_row = 148;
    report.ball_width_px = 92;
    report.ball_disparity_q4 = 69 * 16 + 8;
    report.goal_x_q4[0] = 42 * 16;
    report.goal_x_q4[1] = 177 * 16;
    report.goal_disparity_q4[0] = 23 * 16 + 5;
    report.goal_disparity_q4[1] = 21 * 16 + 10;
    report.opponent_x_q4 = 143 * 16;
    report.opponent_disparity_q4 = 26 * 16;
}

static void the_reference_scene_is_where_it_was(void)
{
    long width;

    reference_scene();
    sightings_from_report(&report, &soccer_tuning_default, &seen);
    TEST_ASSERT_TRUE(seen.ball.valid);
    TEST_ASSERT_INT_WITHIN(6, 230, seen.ball.forward_mm);
    TEST_ASSERT_INT_WITHIN(4, -15, seen.ball.left_mm);
    TEST_ASSERT_TRUE(seen.goal_edge[0].valid && seen.goal_edge[1].valid);
    width = lround(hypot(seen.goal_edge[0].forward_mm - seen.goal_edge[1].forward_mm,
                         seen.goal_edge[0].left_mm - seen.goal_edge[1].left_mm));
    TEST_ASSERT_INT_WITHIN(15, GOAL_WIDTH_MM, width);
    TEST_ASSERT_TRUE(seen.opponent.valid);
    TEST_ASSERT_INT_WITHIN(15, 634 + OPPONENT_RADIUS_MM, seen.opponent.forward_mm);
}

static void another_function_or_a_torn_frame_shows_nothing(void)
{
    reference_scene();
    report.function = FPGA_FUNCTION_CAPTURE;
    sightings_from_report(&report, &soccer_tuning_default, &seen);
    TEST_ASSERT_FALSE(seen.ball.valid || seen.goal_edge[0].valid || seen.opponent.valid);
    report.function = FPGA_FUNCTION_SOCCER;
    report.flags |= REPORT_FRAME_TORN;
    sightings_from_report(&report, &soccer_tuning_default, &seen);
    TEST_ASSERT_FALSE(seen.ball.valid || seen.goal_edge[0].valid || seen.opponent.valid);
}

static void a_ball_in_the_air_is_none(void)
{
    reference_scene();
    report.ball_row = 60;
    sightings_from_report(&report, &soccer_tuning_default, &seen);
    TEST_ASSERT_FALSE(seen.ball.valid);
}

static void a_goal_of_the_wrong_width_is_none(void)
{
    reference_scene();
    report.goal_x_q4[1] = 110 * 16;
    sightings_from_report(&report, &soccer_tuning_default, &seen);
    TEST_ASSERT_FALSE(seen.goal_edge[0].valid || seen.goal_edge[1].valid);
}

/* Straight ahead of the right lens, so far that the lower border cuts it: the ray that grazes its
 * top falls by atan(60.5 / forward) - asin(33.5 / distance), the axis by 9.8 degrees. */
static void see_cut_ball(double forward_mm, uint8_t width_px)
{
    double down = atan2(60.5, forward_mm) - asin(33.5 / hypot(60.5, forward_mm));
    double top =
        119.5 + CAMERA_FOCAL_PX * tan(down - atan2(CAMERA_TILT_SIN_Q12, CAMERA_TILT_COS_Q12));

    report.flags = REPORT_BALL | REPORT_BALL_CLIPPED;
    report.ball_x_q4 = CAMERA_CX_Q4;
    report.ball_row = (uint8_t)lround((top + CAMERA_HEIGHT_PX - 1) / 2);
    report.ball_width_px = width_px;
    sightings_from_report(&report, &soccer_tuning_default, &seen);
}

static void a_ball_cut_by_the_lower_border_is_placed_by_its_top(void)
{
    see_cut_ball(64, 164);
    TEST_ASSERT_TRUE(seen.ball.valid);
    TEST_ASSERT_INT_WITHIN(4, 64, seen.ball.forward_mm);
    see_cut_ball(100, 215);
    TEST_ASSERT_INT_WITHIN(4, 100, seen.ball.forward_mm);
    see_cut_ball(150, 143);
    TEST_ASSERT_INT_WITHIN(5, 150, seen.ball.forward_mm);
    TEST_ASSERT_INT_WITHIN(1, -25, seen.ball.left_mm);
}

static void a_ball_cut_by_the_pictures_side_is_less_certain(void)
{
    uint16_t whole_sigma_mm;

    see_cut_ball(120, 180);
    whole_sigma_mm = seen.ball.sigma_mm;
    report.ball_x_q4 = 60 * 16;
    sightings_from_report(&report, &soccer_tuning_default, &seen);
    TEST_ASSERT_TRUE(seen.ball.valid);
    TEST_ASSERT_TRUE(seen.ball.sigma_mm > 2 * whole_sigma_mm);
}

static void the_foot_of_the_wall_is_placed_by_its_row(void)
{
    /* 300 mm ahead the foot lies 17.4 degrees below the horizon: row 163. */
    report.flags = REPORT_WALL;
    report.wall_row[1] = 163;
    sightings_from_report(&report, &soccer_tuning_default, &seen);
    TEST_ASSERT_FALSE(seen.wall[0].valid);
    TEST_ASSERT_TRUE(seen.wall[1].valid);
    TEST_ASSERT_INT_WITHIN(5, 300, seen.wall[1].forward_mm);
    TEST_ASSERT_INT_WITHIN(2, -26, seen.wall[1].left_mm);
    report.wall_row[1] = 90;
    sightings_from_report(&report, &soccer_tuning_default, &seen);
    TEST_ASSERT_FALSE(seen.wall[1].valid);
}

static void one_eye_places_a_ball_by_its_row(void)
{
    int16_t right_mm;

    /* From the reference scene: row 148, seen by the right eye only, then the same by the left. */
    report.flags = REPORT_BALL | REPORT_BALL_RIGHT_ONLY;
    report.ball_x_q4 = CAMERA_CX_Q4;
    report.ball_row = 148;
    report.ball_width_px = 80;
    sightings_from_report(&report, &soccer_tuning_default, &seen);
    TEST_ASSERT_TRUE(seen.ball.valid);
    TEST_ASSERT_INT_WITHIN(15, 230, seen.ball.forward_mm);
    right_mm = seen.ball.left_mm;
    report.flags = REPORT_BALL | REPORT_BALL_LEFT_ONLY;
    sightings_from_report(&report, &soccer_tuning_default, &seen);
    TEST_ASSERT_INT_WITHIN(1, right_mm + 50, seen.ball.left_mm);
}

static void any_report_is_survived(void)
{
    uint32_t random = 1;
    unsigned round;
    unsigned i;

    for (round = 0; round < 20000; round++) {
        uint8_t *bytes = (uint8_t *)&report;

        for (i = 0; i < sizeof report; i++) {
            random = random * 1664525u + 1013904223u;
            bytes[i] = (uint8_t)(random >> 24);
        }
        report.function = FPGA_FUNCTION_SOCCER;
        report.flags &= (uint16_t)~REPORT_FRAME_TORN;
        sightings_from_report(&report, &soccer_tuning_default, &seen);
        if (seen.ball.valid)
            TEST_ASSERT_TRUE(seen.ball.forward_mm > -60 && seen.ball.forward_mm < 2000);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_reference_scene_is_where_it_was);
    RUN_TEST(another_function_or_a_torn_frame_shows_nothing);
    RUN_TEST(a_ball_in_the_air_is_none);
    RUN_TEST(a_goal_of_the_wrong_width_is_none);
    RUN_TEST(a_ball_cut_by_the_lower_border_is_placed_by_its_top);
    RUN_TEST(a_ball_cut_by_the_pictures_side_is_less_certain);
    RUN_TEST(the_foot_of_the_wall_is_placed_by_its_row);
    RUN_TEST(one_eye_places_a_ball_by_its_row);
    RUN_TEST(any_report_is_survived);
    return UNITY_END();
}
