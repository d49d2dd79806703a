/* Depth and ground position: the paper's reference scene, limits, and agreement of both ways. */
#include <unity.h>

#include "vision/camera.h"
#include "vision/depth.h"

void setUp(void) {}

void tearDown(void) {}

static void depth_is_focal_length_times_baseline_over_disparity(void)
{
    /* f T = 16480.8 px mm. */
    TEST_ASSERT_UINT16_WITHIN(1, 707, depth_mm(373));  /* 23.31 px: the goal's left edge */
    TEST_ASSERT_UINT16_WITHIN(1, 761, depth_mm(346));  /* 21.65 px: its right edge */
    TEST_ASSERT_UINT16_WITHIN(1, 237, depth_mm(1112)); /* 69.50 px: the ball */
    TEST_ASSERT_EQUAL_UINT16(16481, depth_mm(16));
}

static void depth_below_one_pixel_is_far(void)
{
    TEST_ASSERT_EQUAL_UINT16(DEPTH_FAR_MM, depth_mm(15));
    TEST_ASSERT_EQUAL_UINT16(DEPTH_FAR_MM, depth_mm(0));
}

static void a_sub_pixel_step_means_more_the_farther(void)
{
    /* Z / d: at the goal 707 mm / 373 steps = 1.9 mm, at the ball 0.2. Rounded up. */
    TEST_ASSERT_EQUAL_UINT16(2, depth_step_mm(373));
    TEST_ASSERT_EQUAL_UINT16(1, depth_step_mm(1112));
    TEST_ASSERT_EQUAL_UINT16(62, depth_step_mm(66));
    TEST_ASSERT_EQUAL_UINT16(DEPTH_FAR_MM, depth_step_mm(16));
}

static void the_papers_ball_lies_where_it_was_put(void)
{
    ground_point_t point;

    /* Right eye (146.39, 147.69), disparity 69.50: 230.7 mm away at -3.9 degrees, half a ball up.
     */
    TEST_ASSERT_TRUE(depth_ground_point(2342, 2363, 1112, &point));
    TEST_ASSERT_INT16_WITHIN(2, 230, point.forward_mm);
    TEST_ASSERT_INT16_WITHIN(2, -16, point.left_mm);
    TEST_ASSERT_INT16_WITHIN(2, 33, point.height_mm);
}

static void the_papers_goal_is_as_wide_as_a_goal(void)
{
    ground_point_t left;
    ground_point_t right;
    int32_t forward;
    int32_t aside;

    TEST_ASSERT_TRUE(depth_ground_point(676, 960, 373, &left));
    TEST_ASSERT_TRUE(depth_ground_point(2836, 960, 346, &right));
    forward = left.forward_mm - right.forward_mm;
    aside = left.left_mm - right.left_mm;
    TEST_ASSERT_INT32_WITHIN(4 * 600, (int32_t)GOAL_WIDTH_MM * GOAL_WIDTH_MM,
                             forward * forward + aside * aside);
    TEST_ASSERT_INT16_WITHIN(3, 100, left.height_mm);
}

static void no_disparity_means_no_point(void)
{
    ground_point_t point = {1, 2, 3};

    TEST_ASSERT_FALSE(depth_ground_point(2552, 1912, 15, &point));
    TEST_ASSERT_EQUAL_INT16(1, point.forward_mm);
}

static void a_point_on_a_plane_agrees_with_its_disparity(void)
{
    ground_point_t by_disparity;
    ground_point_t by_plane;
    uint16_t d_q4;

    for (d_q4 = 280; d_q4 <= 1264; d_q4 = (uint16_t)(d_q4 + 41)) {
        /* A row at which this disparity is that of the floor: solve by trying rows. */
        uint16_t y_q4 = 1024;

        do {
            TEST_ASSERT_TRUE(depth_ground_point(700, y_q4++, d_q4, &by_disparity));
        } while (by_disparity.height_mm > 0);
        TEST_ASSERT_TRUE(depth_on_plane(700, y_q4, 0, &by_plane));
        TEST_ASSERT_INT16_WITHIN(1 + by_disparity.forward_mm / 100, by_disparity.forward_mm,
                                 by_plane.forward_mm);
        TEST_ASSERT_INT16_WITHIN(4, by_disparity.left_mm, by_plane.left_mm);
    }
}

static void a_ray_above_the_horizon_meets_no_floor(void)
{
    ground_point_t point;

    TEST_ASSERT_FALSE(depth_on_plane(2552, 16 * 60, 0, &point));
    TEST_ASSERT_FALSE(depth_on_plane(2552, 16 * 200, CAMERA_LENS_HEIGHT_MM, &point));
    TEST_ASSERT_TRUE(depth_on_plane(2552, 16 * 70, 0, &point));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(depth_is_focal_length_times_baseline_over_disparity);
    RUN_TEST(depth_below_one_pixel_is_far);
    RUN_TEST(a_sub_pixel_step_means_more_the_farther);
    RUN_TEST(the_papers_ball_lies_where_it_was_put);
    RUN_TEST(the_papers_goal_is_as_wide_as_a_goal);
    RUN_TEST(no_disparity_means_no_point);
    RUN_TEST(a_point_on_a_plane_agrees_with_its_disparity);
    RUN_TEST(a_ray_above_the_horizon_meets_no_floor);
    return UNITY_END();
}
