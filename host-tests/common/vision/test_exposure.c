/* Whether a camera's exposure is settled: steps of light, slow changes, and a busy scene. */
#include <unity.h>

#include "vision/camera.h"
#include "vision/exposure.h"

static exposure_watch_t watch;

void setUp(void)
{
    exposure_reset(&watch);
}

void tearDown(void) {}

/* A frame whose green has this level, 0..63. */
static int look(uint8_t green)
{
    static uint16_t row[CAMERA_WIDTH_PX];
    int i;

    for (i = 0; i < CAMERA_WIDTH_PX; i++)
        row[i] = (uint16_t)(0xF81F | green << 5); /* red and blue do not count */
    for (i = 0; i < CAMERA_HEIGHT_PX; i++)
        exposure_row(&watch, row);
    return exposure_end(&watch);
}

static void a_steady_light_is_settled_from_the_first_frame_on(void)
{
    int i;

    for (i = 0; i < 10; i++)
        TEST_ASSERT_EQUAL_INT(0, look(32));
}

static void slow_changes_are_the_scenes(void)
{
    uint8_t green;

    for (green = 20; green < 60; green += 4)
        TEST_ASSERT_EQUAL_INT(0, look(green));
    for (; green > 20; green -= 4)
        TEST_ASSERT_EQUAL_INT(0, look(green));
}

static void after_a_step_it_is_unsettled_until_it_is_calm(void)
{
    static const uint8_t levels[] = {32, 16, 18, 20, 22, 24, 26, 28, 30};
    unsigned i;

    TEST_ASSERT_EQUAL_INT(0, look(levels[0]));
    for (i = 1; i < sizeof levels; i++)
        TEST_ASSERT_EQUAL_INT(1, look(levels[i]));
    for (i = 1; i < EXPOSURE_CALM_FRAMES; i++)
        TEST_ASSERT_EQUAL_INT(1, look(30));
    for (i = 0; i < 10; i++)
        TEST_ASSERT_EQUAL_INT(0, look(30));
}

static void a_quarter_is_the_limit(void)
{
    look(40);
    TEST_ASSERT_EQUAL_INT(0, look(50));
    TEST_ASSERT_EQUAL_INT(1, look(63));
}

static void a_scene_that_goes_on_changing_is_taken_for_that_in_the_end(void)
{
    unsigned i;

    look(20);
    TEST_ASSERT_EQUAL_INT(1, look(40));
    for (i = 2; i < EXPOSURE_MAX_FRAMES; i++)
        TEST_ASSERT_EQUAL_INT(1, look(i & 1 ? 40 : 36));
    for (i = 0; i < 10; i++)
        TEST_ASSERT_EQUAL_INT(0, look(i & 1 ? 40 : 36));
}

static void light_after_darkness_is_no_change_that_can_be_measured(void)
{
    look(0);
    TEST_ASSERT_EQUAL_INT(0, look(30));
    TEST_ASSERT_EQUAL_INT(1, look(0));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_steady_light_is_settled_from_the_first_frame_on);
    RUN_TEST(slow_changes_are_the_scenes);
    RUN_TEST(after_a_step_it_is_unsettled_until_it_is_calm);
    RUN_TEST(a_quarter_is_the_limit);
    RUN_TEST(a_scene_that_goes_on_changing_is_taken_for_that_in_the_end);
    RUN_TEST(light_after_darkness_is_no_change_that_can_be_measured);
    return UNITY_END();
}
