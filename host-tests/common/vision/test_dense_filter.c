/* The filters for dense maps, on maps small enough to see what happens. */
#include <string.h>
#include <unity.h>

#include "vision/dense_filter.h"

#define NONE   DENSE_INVALID_Q4
#define WIDTH  6
#define HEIGHT 4

static uint32_t work[WIDTH * HEIGHT];

void setUp(void) {}
void tearDown(void) {}

static void small_islands_go_and_large_ones_stay(void)
{
    int16_t map[HEIGHT][WIDTH] = {{80, 80, NONE, 32, NONE, 16},
                                  {80, 82, NONE, 32, NONE, NONE},
                                  {84, 99, 99, NONE, 48, 48},
                                  {84, 99, NONE, NONE, 48, 48}};
    static const int16_t expected[HEIGHT][WIDTH] = {{80, 80, NONE, NONE, NONE, NONE},
                                                    {80, 82, NONE, NONE, NONE, NONE},
                                                    {84, NONE, NONE, NONE, 48, 48},
                                                    {84, NONE, NONE, NONE, 48, 48}};

    /* 82 - 80 and 84 - 80 still belong together, 99 to neither; pieces of 6, 2, 1, 3 and 4. */
    dense_speckles(map[0], WIDTH, HEIGHT, WIDTH, 3, 4, work);
    TEST_ASSERT_EQUAL_INT16_ARRAY(expected[0], map[0], WIDTH * HEIGHT);
}

static void pieces_that_meet_late_are_one(void)
{
    /* A U: two arms that are joined by the last row only. */
    int16_t map[3][5] = {
        {16, NONE, NONE, NONE, 16}, {16, NONE, NONE, NONE, 16}, {16, 16, 16, 16, 16}};
    int16_t before[3][5];

    memcpy(before, map, sizeof map);
    dense_speckles(map[0], 5, 3, 5, 8, 0, work);
    TEST_ASSERT_EQUAL_INT16_ARRAY(before[0], map[0], 15);
    dense_speckles(map[0], 5, 3, 5, 9, 0, work);
    TEST_ASSERT_EQUAL_INT16(NONE, map[0][0]);
    TEST_ASSERT_EQUAL_INT16(NONE, map[2][2]);
}

static void the_filter_keeps_to_the_stride(void)
{
    int16_t map[2][4] = {{16, NONE, 7, 7}, {NONE, 16, 7, 7}};

    dense_speckles(map[0], 2, 2, 4, 1, 0, work);
    TEST_ASSERT_EQUAL_INT16(NONE, map[0][0]);
    TEST_ASSERT_EQUAL_INT16(NONE, map[1][1]);
    TEST_ASSERT_EQUAL_INT16(7, map[0][2]);
    TEST_ASSERT_EQUAL_INT16(7, map[1][3]);
}

static void the_median_takes_away_single_pixels_and_keeps_edges(void)
{
    static const int16_t map[3][5] = {
        {16, 16, 16, 80, 80}, {16, 500, 16, 80, 80}, {NONE, 16, 16, 80, 80}};
    static const int16_t expected[3][5] = {
        {16, 16, 16, 80, 80}, {16, 16, 16, 80, 80}, {16, 16, 16, 80, 80}};
    int16_t out[3][5];

    dense_median(map[0], 5, 3, 5, out[0], 5);
    TEST_ASSERT_EQUAL_INT16_ARRAY(expected[0], out[0], 15);
}

static void the_median_of_a_single_pixel_is_that_pixel(void)
{
    static const int16_t one = 77;
    int16_t out = 0;

    dense_median(&one, 1, 1, 1, &out, 1);
    TEST_ASSERT_EQUAL_INT16(77, out);
}

static void of_two_claims_to_a_right_pixel_the_cheaper_stands(void)
{
    /* x = 8 with 3 px and x = 10 with 5 px both claim right pixel 5. */
    int16_t row[12] = {NONE, NONE, NONE, NONE, NONE, NONE, NONE, NONE, 48, NONE, 80, NONE};
    int16_t again[12];
    uint16_t costs[12] = {0};

    memcpy(again, row, sizeof row);
    costs[8] = 20;
    costs[10] = 10;
    dense_left_right_row(row, costs, 12, 1, 1, work);
    TEST_ASSERT_EQUAL_INT16(NONE, row[8]);
    TEST_ASSERT_EQUAL_INT16(80, row[10]);
    dense_left_right_row(again, costs, 12, 1, 2, work);
    TEST_ASSERT_EQUAL_INT16(48, again[8]); /* 2 px apart are allowed now */
}

static void a_disparity_survives_if_either_whole_pixel_agrees(void)
{
    /* 3.5 px: partners at x - 3 and x - 4. The owner of the latter is another, of the former
     * nobody: no contradiction. */
    int16_t row[12] = {NONE, NONE, NONE, NONE, NONE, NONE, NONE, NONE, NONE, 56, 96, NONE};
    uint16_t costs[12] = {0};

    costs[9] = 9;
    costs[10] = 1; /* 10 - 6 = 4; 9 - 3.5 rounds to the pixel 5 */
    dense_left_right_row(row, costs, 12, 1, 0, work);
    TEST_ASSERT_EQUAL_INT16(56, row[9]);
    TEST_ASSERT_EQUAL_INT16(96, row[10]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(small_islands_go_and_large_ones_stay);
    RUN_TEST(pieces_that_meet_late_are_one);
    RUN_TEST(the_filter_keeps_to_the_stride);
    RUN_TEST(the_median_takes_away_single_pixels_and_keeps_edges);
    RUN_TEST(the_median_of_a_single_pixel_is_that_pixel);
    RUN_TEST(of_two_claims_to_a_right_pixel_the_cheaper_stands);
    RUN_TEST(a_disparity_survives_if_either_whole_pixel_agrees);
    return UNITY_END();
}
