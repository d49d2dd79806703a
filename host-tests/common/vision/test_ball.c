// sources: host-tests/common/vision/painted_scene.c
/* The ball detector on painted discs: sub-pixel place, one-eyed, cut, near, hidden and false balls.
 * A disc of radius r stands for a ball at d = 2 r 50.4/67; its row must fit the floor. */
#include <string.h>
#include <unity.h>

#include "painted_scene.h"
#include "vision/ball.h"
#include "vision/color.h"

static ball_finder_t finder;
static report_t report;

void setUp(void)
{
    scene_clear(0);
}

void tearDown(void) {}

static void look(void)
{
    int row;

    memset(&report, 0, sizeof report);
    ball_begin(&finder, &eye_params_default);
    for (row = 0; row < CAMERA_HEIGHT_PX; row++)
        ball_row(&finder, (uint8_t)row, frame_row(&scene_frames, EYE_LEFT, row),
                 frame_row(&scene_frames, EYE_RIGHT, row));
    ball_end(&finder, &scene_frames, &report);
}

/* Radius of a ball's outline at a disparity, and the row of its centre on the floor, 1/16 px. */
static int32_t radius_q4(int32_t d_q4)
{
    return d_q4 * 67 / 100 * 100 / 101;
}

/* drop 60.5 mm at Z: rows below the horizon (63) = 327 * 60.5 / (Z cos) ~ d * 60.5 / 50.4 - tilt.
 */
static int32_t row_q4(int32_t d_q4)
{
    return 1008 + d_q4 * 123 / 100;
}

static void paint_ball(int32_t x_q4, int32_t d_q4)
{
    scene_disc(PAINT_YELLOW, x_q4, row_q4(d_q4), radius_q4(d_q4), d_q4);
}

/* A painted disc is centred where it is painted; the detector corrects for the sphere's outline,
 * which a real ball has: (1 - (d / 492)^2). */
static int32_t corrected(int32_t d_q4)
{
    return d_q4 - d_q4 * (d_q4 / 16) * (d_q4 / 16) / (492 * 492);
}

static int32_t corrected_x(int32_t x_q4, int32_t d_q4)
{
    return CAMERA_CX_Q4 +
           (x_q4 - CAMERA_CX_Q4) * (492 * 492 - (d_q4 / 16) * (d_q4 / 16)) / (492 * 492);
}

static void both_eyes_give_place_and_disparity_between_pixels(void)
{
    int32_t d_q4;

    for (d_q4 = 16 * 16 + 3; d_q4 < 70 * 16; d_q4 += 117) {
        scene_clear(0);
        paint_ball(2005 - d_q4 / 2, d_q4);
        look();
        TEST_ASSERT_EQUAL_HEX16(REPORT_BALL, report.flags);
        TEST_ASSERT_INT32_WITHIN(3, corrected(d_q4), report.ball_disparity_q4);
        TEST_ASSERT_INT32_WITHIN(3, corrected_x(2005 - d_q4 / 2, d_q4), report.ball_x_q4);
        TEST_ASSERT_INT32_WITHIN(1, row_q4(d_q4) / 16, report.ball_row);
        TEST_ASSERT_INT32_WITHIN(2, radius_q4(d_q4) / 8, report.ball_width_px);
        TEST_ASSERT_GREATER_THAN_UINT8(180, report.ball_confidence);
    }
}

static void noise_gain_and_misaligned_eyes_move_it_little(void)
{
    uint32_t seed;

    for (seed = 1; seed <= 8; seed++) {
        scene_clear(seed & 1 ? 2 : -2);
        paint_ball(1300, 488);
        scene_gain(EYE_LEFT, 90);
        scene_gain(EYE_RIGHT, 60);
        scene_noise(EYE_LEFT, 10, seed);
        scene_noise(EYE_RIGHT, 10, seed + 100);
        look();
        TEST_ASSERT_EQUAL_HEX16(REPORT_BALL, report.flags);
        TEST_ASSERT_INT32_WITHIN(8, corrected(488), report.ball_disparity_q4);
    }
}

static void a_seam_does_not_break_it(void)
{
    paint_ball(2000, 800);
    scene_bar(PAINT_WHITE, 1500, 2400, 126, 128, 800);
    scene_bar(PAINT_WHITE, 1968, 2000, 60, 160, 800);
    /* The bars also lie outside the disc: pitch and wall again, over them. */
    scene_bar(PAINT_PITCH, 0, 2000 - 545, 120, 130, 800);
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_BALL, report.flags);
    TEST_ASSERT_INT32_WITHIN(6, corrected(800), report.ball_disparity_q4);
}

static void no_ball_no_report(void)
{
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
    TEST_ASSERT_EQUAL_UINT8(0, report.ball_confidence);
    scene_disc(PAINT_PINK, 2000, row_q4(600), radius_q4(600), 600);
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
}

static void a_ball_that_leaves_the_right_image_is_measured_at_its_other_end(void)
{
    paint_ball(100, 640); /* radius 26 px, centre 6 px inside */
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_BALL, report.flags);
    /* A real ball would be drawn 1 + (40/492) (133/327) wider apart at this end: 3.3 %. */
    TEST_ASSERT_INT32_WITHIN(6, corrected(640) * 1033 / 1000, report.ball_disparity_q4);
    TEST_ASSERT_INT32_WITHIN(48, 100, report.ball_x_q4);
}

static void one_eye_alone_says_so(void)
{
    paint_ball(16 * 305, 480); /* the left eye's is out at 335 */
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_BALL | REPORT_BALL_RIGHT_ONLY, report.flags);
    TEST_ASSERT_EQUAL_UINT16(0, report.ball_disparity_q4);

    scene_clear(0);
    paint_ball(-16 * 24, 640); /* right: out */
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_BALL | REPORT_BALL_LEFT_ONLY, report.flags);
    TEST_ASSERT_INT32_WITHIN(32, -16 * 24 + 640, report.ball_x_q4);
}

static void a_ball_nearer_than_the_search_range_is_clipped(void)
{
    paint_ball(1200, 90 * 16);
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_BALL | REPORT_BALL_CLIPPED, report.flags);
    TEST_ASSERT_EQUAL_UINT16(0, report.ball_disparity_q4);
    TEST_ASSERT_INT32_WITHIN(64, 1200, report.ball_x_q4);

    scene_clear(0);
    scene_disc(PAINT_YELLOW, 900, 270 * 16, 110 * 16, 150 * 16); /* its upper part is left */
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_BALL | REPORT_BALL_CLIPPED, report.flags);
}

static void yellow_things_beyond_the_wall_are_no_ball(void)
{
    scene_disc(PAINT_YELLOW, 2000, 30 * 16, 20 * 16, 200);
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
    paint_ball(1300, 400);
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_BALL, report.flags);
    TEST_ASSERT_INT32_WITHIN(16, 1300, report.ball_x_q4);
}

static void what_hides_a_part_of_it_does_not_move_it(void)
{
    /* A body at 55 px, nearer than the ball at 40, hides its right third in both eyes. */
    paint_ball(2000, 640);
    scene_bar(PAINT_WHITE, 2000 + 120, 2000 + 900, 40, 160, 880);
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_BALL, report.flags);
    TEST_ASSERT_INT32_WITHIN(8, corrected(640), report.ball_disparity_q4);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(both_eyes_give_place_and_disparity_between_pixels);
    RUN_TEST(noise_gain_and_misaligned_eyes_move_it_little);
    RUN_TEST(a_seam_does_not_break_it);
    RUN_TEST(no_ball_no_report);
    RUN_TEST(a_ball_that_leaves_the_right_image_is_measured_at_its_other_end);
    RUN_TEST(one_eye_alone_says_so);
    RUN_TEST(a_ball_nearer_than_the_search_range_is_clipped);
    RUN_TEST(yellow_things_beyond_the_wall_are_no_ball);
    RUN_TEST(what_hides_a_part_of_it_does_not_move_it);
    return UNITY_END();
}
