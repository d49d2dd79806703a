/* Correspondence at a point: places, ties, borders, sub-pixels, and each constraint. */
#include <string.h>
#include <unity.h>

#include "vision/correspondence.h"

#define WIDTH  96
#define HEIGHT 24

static uint8_t left_pixels[HEIGHT][WIDTH];
static uint8_t right_pixels[HEIGHT][WIDTH];
static const image_view_t left = {left_pixels[0], WIDTH, HEIGHT, WIDTH};
static const image_view_t right = {right_pixels[0], WIDTH, HEIGHT, WIDTH};
static match_params_t params;
static match_t match;

static uint8_t texture_at(int x, int y)
{
    uint32_t v = (uint32_t)x * 2654435761u + (uint32_t)y * 40503u;

    v ^= v >> 15;
    return (uint8_t)((v * 2246822519u) >> 24);
}

/* The right image shows what the left shows `shift` further right and `rows` further down. */
static void paint_shifted(int shift, int rows)
{
    int x;
    int y;

    for (y = 0; y < HEIGHT; y++) {
        for (x = 0; x < WIDTH; x++) {
            left_pixels[y][x] = texture_at(x, y);
            right_pixels[y][x] = texture_at(x + shift, y + rows);
        }
    }
}

static void paint_flat(uint8_t value)
{
    memset(left_pixels, value, sizeof left_pixels);
    memset(right_pixels, value, sizeof right_pixels);
}

void setUp(void)
{
    memset(&params, 0, sizeof params);
    memset(&match, 0, sizeof match);
    params.method = MATCH_SAD;
    params.block_width = params.block_height = 8;
    params.reference_is_right = 1;
    params.disparity_max = 40;
}

void tearDown(void) {}

static void every_method_finds_the_shift(void)
{
    static const match_method_t methods[] = {MATCH_SAD, MATCH_SSD, MATCH_NCC};
    unsigned i;

    paint_shifted(17, 0);
    for (i = 0; i < 3; i++) {
        params.method = methods[i];
        TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 30, 12, &params, &match));
        TEST_ASSERT_EQUAL_UINT8(17, match.disparity);
        TEST_ASSERT_EQUAL_UINT32(methods[i] == MATCH_NCC ? MATCH_NCC_ONE : 0, match.cost);
    }
}

static void the_left_eye_may_be_the_reference(void)
{
    paint_shifted(17, 0);
    params.reference_is_right = 0;
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 60, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT8(17, match.disparity);
}

static void an_eight_pixel_block_covers_minus_four_to_plus_three(void)
{
    paint_flat(0);
    right_pixels[12 - 4][30 - 4] = 1;
    right_pixels[12 + 3][30 + 3] = 2;
    right_pixels[12 - 5][30] = right_pixels[12 + 4][30] = 100;
    right_pixels[12][30 - 5] = right_pixels[12][30 + 4] = 100;
    TEST_ASSERT_EQUAL_UINT32(3, match_cost(MATCH_SAD, &right, 30, 12, &left, 30, 12, 8, 8));
    TEST_ASSERT_EQUAL_UINT32(5, match_cost(MATCH_SSD, &right, 30, 12, &left, 30, 12, 8, 8));
}

static void a_misaligned_eye_is_found_by_searching_rows(void)
{
    paint_shifted(11, 2);
    params.rows = 2;
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 30, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT8(11, match.disparity);
    TEST_ASSERT_EQUAL_INT8(2, match.row_offset);
    TEST_ASSERT_EQUAL_UINT32(0, match.cost);
}

static void ties_go_to_the_smallest_disparity_and_row_offset(void)
{
    paint_flat(90);
    params.rows = 2;
    params.disparity_min = 3;
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 30, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT8(3, match.disparity);
    TEST_ASSERT_EQUAL_INT8(0, match.row_offset);
    TEST_ASSERT_EQUAL_UINT16(48, match.disparity_q4);
}

static void a_block_beyond_the_border_is_an_error(void)
{
    paint_shifted(0, 0);
    TEST_ASSERT_EQUAL(MATCH_BORDER, match_find(&left, &right, 3, 12, &params, &match));
    TEST_ASSERT_EQUAL(MATCH_BORDER, match_find(&left, &right, 30, 3, &params, &match));
    TEST_ASSERT_EQUAL(MATCH_BORDER, match_find(&left, &right, WIDTH - 3, 12, &params, &match));
    TEST_ASSERT_EQUAL(MATCH_BORDER, match_find(&left, &right, 30, HEIGHT - 3, &params, &match));
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 4, 4, &params, &match));
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, WIDTH - 4, HEIGHT - 4, &params, &match));
    params.disparity_min = params.disparity_max = 40;
    TEST_ASSERT_EQUAL(MATCH_BORDER, match_find(&left, &right, WIDTH - 43, 12, &params, &match));
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, WIDTH - 44, 12, &params, &match));
}

static void bad_parameters_are_refused(void)
{
    image_view_t smaller = left;

    paint_shifted(5, 0);
    smaller.width--;
    TEST_ASSERT_EQUAL(MATCH_BAD_PARAM, match_find(&smaller, &right, 30, 12, &params, &match));
    params.block_width = 0;
    TEST_ASSERT_EQUAL(MATCH_BAD_PARAM, match_find(&left, &right, 30, 12, &params, &match));
    params.block_width = MATCH_MAX_BLOCK + 1;
    TEST_ASSERT_EQUAL(MATCH_BAD_PARAM, match_find(&left, &right, 30, 12, &params, &match));
    params.block_width = 8;
    params.disparity_min = 41;
    TEST_ASSERT_EQUAL(MATCH_BAD_PARAM, match_find(&left, &right, 30, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT8(0, match.disparity);
}

static void sub_pixels_lean_to_the_cheaper_neighbour(void)
{
    TEST_ASSERT_EQUAL_INT(0, match_subpixel_q4(MATCH_SAD, 90, 10, 90));
    TEST_ASSERT_EQUAL_INT(8, match_subpixel_q4(MATCH_SAD, 100, 20, 20));
    TEST_ASSERT_EQUAL_INT(-8, match_subpixel_q4(MATCH_SAD, 20, 20, 100));
    TEST_ASSERT_EQUAL_INT(4, match_subpixel_q4(MATCH_SAD, 110, 10, 60));
    TEST_ASSERT_EQUAL_INT(0, match_subpixel_q4(MATCH_SAD, 7, 7, 7));
    /* A parabola with its minimum at +1/4: (x - 1/4)^2 * 1600 at -1, 0, 1. */
    TEST_ASSERT_EQUAL_INT(4, match_subpixel_q4(MATCH_SSD, 2500, 100, 900));
    TEST_ASSERT_EQUAL_INT(4, match_subpixel_q4(MATCH_NCC, 7500, 9900, 9100));
}

static void half_a_pixel_of_shift_is_found(void)
{
    int x;
    int y;

    /* Right image: mean of neighbours, that is the left image half a pixel on. */
    for (y = 0; y < HEIGHT; y++) {
        for (x = 0; x < WIDTH; x++) {
            left_pixels[y][x] = (uint8_t)(2 * x + (x / 7 % 2 ? 30 : 0));
            right_pixels[y][x] = 0;
        }
        for (x = 0; x + 13 < WIDTH; x++)
            right_pixels[y][x] = (uint8_t)((left_pixels[y][x + 12] + left_pixels[y][x + 13]) / 2);
    }
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 30, 12, &params, &match));
    TEST_ASSERT_UINT16_WITHIN(3, 12 * 16 + 8, match.disparity_q4);
}

static void uniqueness_refuses_a_repeated_pattern(void)
{
    int x;
    int y;

    params.checks = CHECK_UNIQUENESS;
    params.uniqueness_percent = 15;
    paint_shifted(17, 0);
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 30, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT8(0, match.failed);
    for (y = 0; y < HEIGHT; y++)
        for (x = 0; x < WIDTH; x++)
            left_pixels[y][x] = right_pixels[y][x] = (uint8_t)(x / 4 % 2 ? 200 : 20);
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 30, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT8(CHECK_UNIQUENESS, match.failed);
    params.checks = 0;
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 30, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT8(0, match.failed);
}

static void similarity_and_texture_have_limits(void)
{
    paint_flat(100);
    memset(left_pixels, 110, sizeof left_pixels);
    params.checks = CHECK_SIMILARITY | CHECK_TEXTURE;
    params.similarity_limit = 640;
    params.texture_min = 0;
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 30, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT32(640, match.cost);
    TEST_ASSERT_EQUAL_UINT8(0, match.failed);
    params.similarity_limit = 639;
    params.texture_min = 1;
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 30, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT8(CHECK_SIMILARITY | CHECK_TEXTURE, match.failed);
    TEST_ASSERT_EQUAL_UINT32(0, match.texture);
}

static void left_right_refuses_what_only_one_eye_sees(void)
{
    int x;
    int y;

    params.checks = CHECK_LEFT_RIGHT;
    params.left_right_max = 1;
    paint_shifted(9, 0);
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 50, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT8(0, match.failed);
    /* A patch in the right eye only, a poor copy of what stands elsewhere in both. */
    for (y = 0; y < HEIGHT; y++)
        for (x = 40; x < 60; x++)
            right_pixels[y][x] = (uint8_t)(texture_at(x + 30, y) / 2 + 64);
    TEST_ASSERT_EQUAL(MATCH_OK, match_find(&left, &right, 50, 12, &params, &match));
    TEST_ASSERT_EQUAL_UINT8(CHECK_LEFT_RIGHT, match.failed);
}

static void ordering_drops_the_worse_of_two_that_cross(void)
{
    match_t row[4];
    int16_t x_other[4] = {20, 50, 40, 60};

    memset(row, 0, sizeof row);
    row[0].cost = 5;
    row[1].cost = 90;
    row[2].cost = 10;
    row[3].cost = 5;
    match_check_ordering(MATCH_SAD, row, x_other, 4);
    TEST_ASSERT_EQUAL_UINT8(0, row[0].failed);
    TEST_ASSERT_EQUAL_UINT8(CHECK_ORDERING, row[1].failed);
    TEST_ASSERT_EQUAL_UINT8(0, row[2].failed);
    TEST_ASSERT_EQUAL_UINT8(0, row[3].failed);

    row[1].failed = 0;
    match_check_ordering(MATCH_NCC, row, x_other, 4);
    TEST_ASSERT_EQUAL_UINT8(0, row[1].failed);
    TEST_ASSERT_EQUAL_UINT8(CHECK_ORDERING, row[2].failed);
}

static void continuity_drops_what_jumps_from_both_neighbours(void)
{
    match_t row[6];
    int i;

    memset(row, 0, sizeof row);
    for (i = 0; i < 6; i++)
        row[i].disparity_q4 = (uint16_t)(i < 3 ? 320 : 800); /* a depth edge is no error */
    row[1].disparity_q4 = 500;
    match_check_continuity(row, 6, 32);
    TEST_ASSERT_EQUAL_UINT8(CHECK_CONTINUITY, row[1].failed);
    for (i = 3; i < 6; i++)
        TEST_ASSERT_EQUAL_UINT8(0, row[i].failed);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(every_method_finds_the_shift);
    RUN_TEST(the_left_eye_may_be_the_reference);
    RUN_TEST(an_eight_pixel_block_covers_minus_four_to_plus_three);
    RUN_TEST(a_misaligned_eye_is_found_by_searching_rows);
    RUN_TEST(ties_go_to_the_smallest_disparity_and_row_offset);
    RUN_TEST(a_block_beyond_the_border_is_an_error);
    RUN_TEST(bad_parameters_are_refused);
    RUN_TEST(sub_pixels_lean_to_the_cheaper_neighbour);
    RUN_TEST(half_a_pixel_of_shift_is_found);
    RUN_TEST(uniqueness_refuses_a_repeated_pattern);
    RUN_TEST(similarity_and_texture_have_limits);
    RUN_TEST(left_right_refuses_what_only_one_eye_sees);
    RUN_TEST(ordering_drops_the_worse_of_two_that_cross);
    RUN_TEST(continuity_drops_what_jumps_from_both_neighbours);
    return UNITY_END();
}
