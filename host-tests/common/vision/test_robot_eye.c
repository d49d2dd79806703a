// sources: host-tests/common/vision/painted_scene.c
/* The whole eye: wall's foot, nothing seen in the dark, parameters, and everything at once. */
#include <string.h>
#include <unity.h>

#include "painted_scene.h"
#include "vision/robot_eye.h"

static robot_eye_t eye;
static report_t report;
static eye_params_t params;

void setUp(void)
{
    scene_clear(0);
    params = eye_params_default;
}

void tearDown(void) {}

static void look(void)
{
    int row;

    memset(&eye, 0xA5, sizeof eye); /* begin must not rely on what was there */
    memset(&report, 0xA5, sizeof report);
    robot_eye_begin(&eye, &params);
    for (row = 0; row < CAMERA_HEIGHT_PX; row++)
        robot_eye_row(&eye, (uint8_t)row, frame_row(&scene_frames, EYE_LEFT, row),
                      frame_row(&scene_frames, EYE_RIGHT, row));
    robot_eye_end(&eye, &scene_frames, &report);
}

static void the_foot_of_the_wall_is_where_grey_meets_green(void)
{
    int i;

    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_WALL, report.flags);
    for (i = 0; i < (int)REPORT_WALL_COLUMNS; i++)
        TEST_ASSERT_EQUAL_UINT8(SCENE_FOOT_ROW, report.wall_row[i]);
}

static void what_hides_the_foot_leaves_its_column_out(void)
{
    scene_disc(PAINT_YELLOW, 160 * 16, 105 * 16, 22 * 16, 33 * 16);
    scene_stripes(260 * 16, 6 * 16, 7, 40, 140, 30 * 16);
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_WALL | REPORT_BALL | REPORT_OPPONENT, report.flags);
    TEST_ASSERT_EQUAL_UINT8(SCENE_FOOT_ROW, report.wall_row[0]);
    TEST_ASSERT_EQUAL_UINT8(0, report.wall_row[1]);
    TEST_ASSERT_EQUAL_UINT8(0, report.wall_row[2]);
}

static void lines_on_the_pitch_are_no_foot(void)
{
    scene_bar(PAINT_WHITE, 0, 5200, 120, 124, 0);
    scene_bar(PAINT_WHITE, 0, 5200, 160, 169, 0);
    look();
    TEST_ASSERT_EQUAL_UINT8(SCENE_FOOT_ROW, report.wall_row[1]);
}

static void black_eyes_see_nothing(void)
{
    report_t nothing;

    memset(scene_pixels, 0, sizeof scene_pixels);
    memset(&nothing, 0, sizeof nothing);
    look();
    TEST_ASSERT_EQUAL_HEX16(0, report.flags);
    TEST_ASSERT_EQUAL_MEMORY(&nothing.wall_row, &report.wall_row, sizeof nothing.wall_row);
    TEST_ASSERT_EQUAL_UINT8(0, report.ball_confidence);
    TEST_ASSERT_EQUAL_UINT8(0, report.delay);
    TEST_ASSERT_EQUAL_UINT8(0, report.function);
    TEST_ASSERT_EQUAL_UINT8(0, report.sequence);
    TEST_ASSERT_EQUAL_UINT16(0, report.exposure_time);
}

static void any_noise_is_survived(void)
{
    uint32_t seed;

    for (seed = 1; seed <= 20; seed++) {
        memset(scene_pixels, seed & 1 ? 0x55 : 0, sizeof scene_pixels);
        scene_noise(EYE_LEFT, 255, seed);
        scene_noise(EYE_RIGHT, 255, seed * 7);
        look();
        TEST_ASSERT_TRUE(report.ball_x_q4 < 16 * CAMERA_WIDTH_PX);
        TEST_ASSERT_TRUE(report.opponent_disparity_q4 <= 16 * 80);
    }
}

static void everything_at_once(void)
{
    scene_bar(PAINT_BLACK, 42 * 16, 177 * 16, 38, 96, 22 * 16);
    scene_stripes(200 * 16, 5 * 16, 7, 45, 130, 30 * 16);
    scene_disc(PAINT_YELLOW, 100 * 16, 135 * 16, 39 * 16, 59 * 16);
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_BALL | REPORT_GOAL_LEFT_EDGE | REPORT_GOAL_RIGHT_EDGE |
                                REPORT_OPPONENT | REPORT_WALL,
                            report.flags);
}

static void the_lines_and_the_search_range_can_be_moved(void)
{
    scene_bar(PAINT_BLACK, 42 * 16, 177 * 16, 38, 70, 22 * 16);
    params.goal_row = 90;
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_WALL, report.flags);
    params.goal_row = 50;
    look();
    TEST_ASSERT_BITS_HIGH(REPORT_GOAL_LEFT_EDGE | REPORT_GOAL_RIGHT_EDGE, report.flags);
    params.search_max = 16;
    look();
    TEST_ASSERT_EQUAL_HEX16(REPORT_WALL, report.flags);
}

static void the_margin_says_how_yellow_a_ball_is(void)
{
    scene_disc(PAINT_YELLOW, 160 * 16, 150 * 16, 45 * 16, 69 * 16);
    look();
    TEST_ASSERT_BITS_HIGH(REPORT_BALL, report.flags);
    params.yellow_margin = 255;
    look();
    TEST_ASSERT_BITS_LOW(REPORT_BALL, report.flags);
}

/* Scenes in which between them each parameter decides about something. */
#define SCENES 2
static void paint(int scene)
{
    scene_clear(scene == 0 ? 2 : 5);
    if (scene == 0) {
        /* A line on the wall, so that it matters which rows are compared. */
        scene_bar(PAINT_WHITE, 0, 200 * 16, 58, 61, 22 * 16);
        scene_bar(PAINT_BLACK, 42 * 16, 177 * 16, 38, 96, 22 * 16);
        scene_stripes(200 * 16, 5 * 16, 7, 45, 130, 30 * 16);
        scene_disc(PAINT_YELLOW, 150 * 16, 170 * 16, 39 * 16, 59 * 16);
        scene_noise(EYE_LEFT, 8, 1);
        scene_noise(EYE_RIGHT, 8, 2);
    } else {
        scene_disc(PAINT_YELLOW, 150 * 16, 92 * 16, 14 * 16, 22 * 16);
        scene_bar(PAINT_PITCH, 148 * 16, 152 * 16, 72, 112, 22 * 16);
    }
}

/* Whether anything of the reports changes when byte `at` of the parameters is `value`. */
static int acts(uint8_t at, uint8_t value)
{
    uint8_t bytes[EYE_PARAM_COUNT];
    report_t usual;
    int scene;

    for (scene = 0; scene < SCENES; scene++) {
        paint(scene);
        params = eye_params_default;
        look();
        usual = report;
        eye_params_encode(&params, bytes);
        bytes[at] = value;
        eye_params_decode(bytes, &params);
        look();
        if (memcmp(&usual, &report, sizeof usual) != 0)
            return 1;
    }
    return 0;
}

static void every_parameter_of_the_list_acts(void)
{
    uint8_t at = 0;
    unsigned i;

    for (i = 0; i < FPGA_REGISTER_COUNT; i++) {
        const fpga_register_t *parameter = &fpga_registers[i];

        if (!parameter->is_param)
            continue;
        TEST_ASSERT_TRUE_MESSAGE(acts(at, (uint8_t)parameter->min) ||
                                     acts(at, (uint8_t)parameter->max),
                                 parameter->name);
        at++;
    }
    TEST_ASSERT_EQUAL_UINT(EYE_PARAM_COUNT, at);
}

static void a_row_of_large_frames_is_the_mean_of_two(void)
{
    static uint16_t upper[2 * CAMERA_WIDTH_PX];
    static uint16_t lower[2 * CAMERA_WIDTH_PX];
    static uint16_t row[CAMERA_WIDTH_PX];

    upper[0] = 0xFFFF;
    upper[1] = 0xFFFF;
    lower[0] = 0xFFFF;
    lower[1] = 0xFFFF;
    /* red 31 + 0 + 0 + 0, green 1 + 1 + 0 + 0 (a half, rounded up), blue 1 + 0 + 0 + 0 */
    upper[638] = 31u << 11 | 1u << 5 | 1u;
    upper[639] = 1u << 5;
    frame_halve_rows(upper, lower, row);
    TEST_ASSERT_EQUAL_HEX16(0xFFFF, row[0]);
    TEST_ASSERT_EQUAL_HEX16(0, row[1]);
    TEST_ASSERT_EQUAL_HEX16(8u << 11 | 1u << 5, row[319]);
}

static void parameters_out_of_range_are_brought_into_it(void)
{
    int scene;

    for (scene = 0; scene < SCENES; scene++) {
        paint(scene);
        memset(&params, 255, sizeof params);
        look(); /* must stay inside the frames; the sanitizers watch */
        TEST_ASSERT_EQUAL_UINT8(235, eye.params.opponent_row);
        TEST_ASSERT_EQUAL_UINT8(127, eye.params.search_max);
        TEST_ASSERT_EQUAL_UINT8(255, eye.params.yellow_margin);
        memset(&params, 0, sizeof params);
        look();
        TEST_ASSERT_EQUAL_UINT8(4, eye.params.goal_row);
        TEST_ASSERT_EQUAL_UINT8(3, eye.params.stripe_edges);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_foot_of_the_wall_is_where_grey_meets_green);
    RUN_TEST(what_hides_the_foot_leaves_its_column_out);
    RUN_TEST(lines_on_the_pitch_are_no_foot);
    RUN_TEST(black_eyes_see_nothing);
    RUN_TEST(any_noise_is_survived);
    RUN_TEST(everything_at_once);
    RUN_TEST(the_lines_and_the_search_range_can_be_moved);
    RUN_TEST(the_margin_says_how_yellow_a_ball_is);
    RUN_TEST(every_parameter_of_the_list_acts);
    RUN_TEST(a_row_of_large_frames_is_the_mean_of_two);
    RUN_TEST(parameters_out_of_range_are_brought_into_it);
    return UNITY_END();
}
