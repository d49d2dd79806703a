/* Edges as features: where they lie, how they point, and how they are matched. */
#include <string.h>
#include <unity.h>

#include "vision/features.h"

#define WIDTH  64
#define HEIGHT 8

static uint8_t pixels[HEIGHT][WIDTH];
static const image_view_t view = {pixels[0], WIDTH, HEIGHT, WIDTH};
static feature_t found[16];

void setUp(void)
{
    memset(pixels, 0, sizeof pixels);
}

void tearDown(void) {}

static void paint_step(int x, uint8_t level)
{
    int y;

    for (y = 0; y < HEIGHT; y++)
        memset(&pixels[y][x], level, (size_t)(WIDTH - x));
}

static void a_step_is_one_edge_between_its_pixels(void)
{
    paint_step(20, 100);
    TEST_ASSERT_EQUAL_UINT16(1, features_of_row(&view, 4, 50, found, 16));
    TEST_ASSERT_EQUAL_UINT16(19 * 16 + 8, found[0].x_q4);
    TEST_ASSERT_EQUAL_UINT16(400, found[0].strength);
    TEST_ASSERT_EQUAL_UINT8(0, found[0].orientation);
}

static void weak_edges_and_rows_outside_give_none(void)
{
    paint_step(20, 10);
    TEST_ASSERT_EQUAL_UINT16(0, features_of_row(&view, 4, 50, found, 16));
    TEST_ASSERT_EQUAL_UINT16(0, features_of_row(&view, -1, 1, found, 16));
    TEST_ASSERT_EQUAL_UINT16(0, features_of_row(&view, HEIGHT, 1, found, 16));
    TEST_ASSERT_EQUAL_UINT16(0, features_of_row(&view, 4, 1, found, 0));
}

static void orientation_goes_round_in_sixteen_sectors(void)
{
    static const gradient_t gradients[] = {
        {10, 0},  {10, 4},   {10, 10},   {4, 10},   {0, 10},  {-4, 10}, {-10, 10}, {-10, 4},
        {-10, 0}, {-10, -4}, {-10, -10}, {-4, -10}, {0, -10}, {4, -10}, {10, -10}, {10, -4}};
    uint8_t i;

    for (i = 0; i < FEATURE_ORIENTATIONS; i++)
        TEST_ASSERT_EQUAL_UINT8(i, gradient_orientation(gradients[i]));
}

static feature_t feature(uint16_t x_px, uint16_t strength, uint8_t orientation)
{
    feature_t f;

    f.x_q4 = (uint16_t)(16 * x_px);
    f.strength = strength;
    f.orientation = orientation;
    return f;
}

static const feature_params_t usual = {1, 40 * 16, 1, 50, CHECK_UNIQUENESS | CHECK_ORDERING};

static void like_edges_within_the_search_range_are_partners(void)
{
    feature_t right[3];
    feature_t left[4];
    int16_t partner[3];

    right[0] = feature(10, 400, 0);
    right[1] = feature(20, 300, 8);
    right[2] = feature(30, 200, 4);
    left[0] = feature(9, 400, 0); /* further left than disparity 0 */
    left[1] = feature(32, 380, 15);
    left[2] = feature(41, 310, 8);
    left[3] = feature(80, 200, 4); /* beyond the search range */
    TEST_ASSERT_EQUAL_UINT16(2, features_match(right, 3, left, 4, &usual, partner));
    TEST_ASSERT_EQUAL_INT16(1, partner[0]);
    TEST_ASSERT_EQUAL_INT16(2, partner[1]);
    TEST_ASSERT_EQUAL_INT16(FEATURE_NO_PARTNER, partner[2]);
}

static void uniqueness_gives_a_partner_to_the_more_alike(void)
{
    feature_t right[2];
    feature_t left[1];
    int16_t partner[2];
    feature_params_t params = usual;

    right[0] = feature(10, 300, 0);
    right[1] = feature(14, 390, 0);
    left[0] = feature(30, 400, 0);
    TEST_ASSERT_EQUAL_UINT16(1, features_match(right, 2, left, 1, &params, partner));
    TEST_ASSERT_EQUAL_INT16(FEATURE_NO_PARTNER, partner[0]);
    TEST_ASSERT_EQUAL_INT16(0, partner[1]);
    params.checks = 0;
    TEST_ASSERT_EQUAL_UINT16(2, features_match(right, 2, left, 1, &params, partner));
}

static void ordering_drops_the_less_alike_of_two_that_cross(void)
{
    feature_t right[2];
    feature_t left[2];
    int16_t partner[2];
    feature_params_t params = usual;

    right[0] = feature(10, 200, 0);
    right[1] = feature(14, 400, 0);
    left[0] = feature(30, 400, 0);
    left[1] = feature(34, 210, 0);
    TEST_ASSERT_EQUAL_UINT16(1, features_match(right, 2, left, 2, &params, partner));
    TEST_ASSERT_EQUAL_INT16(FEATURE_NO_PARTNER, partner[0]);
    TEST_ASSERT_EQUAL_INT16(0, partner[1]);
    params.checks = CHECK_UNIQUENESS;
    TEST_ASSERT_EQUAL_UINT16(2, features_match(right, 2, left, 2, &params, partner));
}

static void the_left_eye_may_be_the_reference(void)
{
    feature_t left[1];
    feature_t right[2];
    int16_t partner[1];
    feature_params_t params = usual;

    params.reference_is_right = 0;
    left[0] = feature(30, 400, 0);
    right[0] = feature(12, 400, 0);
    right[1] = feature(40, 400, 0);
    TEST_ASSERT_EQUAL_UINT16(1, features_match(left, 1, right, 2, &params, partner));
    TEST_ASSERT_EQUAL_INT16(0, partner[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_step_is_one_edge_between_its_pixels);
    RUN_TEST(weak_edges_and_rows_outside_give_none);
    RUN_TEST(orientation_goes_round_in_sixteen_sectors);
    RUN_TEST(like_edges_within_the_search_range_are_partners);
    RUN_TEST(uniqueness_gives_a_partner_to_the_more_alike);
    RUN_TEST(ordering_drops_the_less_alike_of_two_that_cross);
    RUN_TEST(the_left_eye_may_be_the_reference);
    return UNITY_END();
}
