/* What the divide-free tests take for ball and pitch. Grey and HSV are compared with OpenCV for
 * every colour in host-tests/opencv; a few known values here also run on the 68k. */
#include <unity.h>

#include "vision/camera.h"
#include "vision/color.h"

void setUp(void) {}

void tearDown(void) {}

static uint16_t pixel(int red, int green, int blue)
{
    return (uint16_t)(red >> 3 << 11 | green >> 2 << 5 | blue >> 3);
}

static int is_yellow(int red, int green, int blue)
{
    uint16_t row[3];
    uint8_t mask[3];

    row[0] = row[1] = row[2] = pixel(red, green, blue);
    color_yellow_mask(row, 3, &eye_params_default, mask);
    return mask[1];
}

static int is_pitch(uint16_t red, uint16_t green, uint16_t blue)
{
    return color_is_pitch(1, red, green, blue, &eye_params_default);
}

static void the_ball_is_yellow_in_light_and_in_shadow(void)
{
    TEST_ASSERT_TRUE(is_yellow(230, 200, 30));
    TEST_ASSERT_TRUE(is_yellow(148, 136, 38));
    TEST_ASSERT_TRUE(is_yellow(99, 93, 33)); /* half the light, and warm */
    TEST_ASSERT_TRUE(is_yellow(82, 77, 24));
    TEST_ASSERT_TRUE(is_yellow(48, 44, 8)); /* its underside in such light */
}

static void nothing_else_on_the_pitch_is_yellow(void)
{
    TEST_ASSERT_FALSE(is_yellow(97, 97, 97)); /* wall */
    TEST_ASSERT_FALSE(is_yellow(82, 77, 57)); /* wall in warm light */
    TEST_ASSERT_FALSE(is_yellow(255, 255, 255));
    TEST_ASSERT_FALSE(is_yellow(132, 121, 100)); /* white in warm light */
    TEST_ASSERT_FALSE(is_yellow(63, 134, 79));   /* pitch */
    TEST_ASSERT_FALSE(is_yellow(49, 93, 41));
    TEST_ASSERT_FALSE(is_yellow(12, 12, 12)); /* goal */
    TEST_ASSERT_FALSE(is_yellow(8, 8, 0));
    TEST_ASSERT_FALSE(is_yellow(230, 120, 160)); /* a pink ball */
    TEST_ASSERT_FALSE(is_yellow(230, 110, 20));  /* orange */
    TEST_ASSERT_FALSE(is_yellow(40, 200, 40));
}

static void a_single_yellow_pixel_is_not_enough_nor_a_single_grey_one_a_gap(void)
{
    uint16_t row[7];
    uint8_t mask[7];
    int i;

    for (i = 0; i < 7; i++)
        row[i] = pixel(104, 104, 104);
    row[3] = pixel(150, 136, 72);
    color_yellow_mask(row, 7, &eye_params_default, mask);
    for (i = 0; i < 7; i++)
        TEST_ASSERT_EQUAL_UINT8(0, mask[i]);

    for (i = 0; i < 7; i++)
        row[i] = pixel(200, 184, 48);
    row[3] = pixel(104, 104, 104);
    color_yellow_mask(row, 7, &eye_params_default, mask);
    for (i = 0; i < 7; i++)
        TEST_ASSERT_EQUAL_UINT8(1, mask[i]);
}

static void the_pitch_is_green_and_nothing_else(void)
{
    TEST_ASSERT_TRUE(is_pitch(56, 132, 72));
    TEST_ASSERT_TRUE(is_pitch(41, 93, 41));
    TEST_ASSERT_FALSE(is_pitch(97, 97, 97));
    TEST_ASSERT_FALSE(is_pitch(82, 77, 57));
    TEST_ASSERT_FALSE(is_pitch(200, 184, 48));
    TEST_ASSERT_FALSE(is_pitch(0, 0, 0));
    TEST_ASSERT_FALSE(is_pitch(0, 4, 0));    /* goal, in RGB565 */
    TEST_ASSERT_FALSE(is_pitch(24, 36, 32)); /* dark plastic */
}

static void grey_and_hsv_of_known_colours(void)
{
    hsv_t hsv = color_hsv(255, 255, 0);

    TEST_ASSERT_EQUAL_UINT8(76, color_grey(255, 0, 0));
    TEST_ASSERT_EQUAL_UINT8(150, color_grey(0, 255, 0));
    TEST_ASSERT_EQUAL_UINT8(29, color_grey(0, 0, 255));
    TEST_ASSERT_EQUAL_UINT8(255, color_grey(255, 255, 255));
    TEST_ASSERT_EQUAL_UINT8(30, hsv.hue);
    TEST_ASSERT_EQUAL_UINT8(255, hsv.saturation);
    TEST_ASSERT_EQUAL_UINT8(255, hsv.value);
    hsv = color_hsv(255, 0, 8);
    TEST_ASSERT_EQUAL_UINT8(179, hsv.hue);
    hsv = color_hsv(7, 7, 7);
    TEST_ASSERT_EQUAL_UINT8(0, hsv.hue);
    TEST_ASSERT_EQUAL_UINT8(0, hsv.saturation);
}

static void yellowness_is_zero_for_greys_and_grows_with_the_light(void)
{
    TEST_ASSERT_EQUAL_INT16(0, color_yellowness(0));
    TEST_ASSERT_EQUAL_INT16(248 + 252, color_yellowness(pixel(255, 255, 0)));
    TEST_ASSERT_EQUAL_INT16(-496, color_yellowness(pixel(0, 0, 255)));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_ball_is_yellow_in_light_and_in_shadow);
    RUN_TEST(nothing_else_on_the_pitch_is_yellow);
    RUN_TEST(a_single_yellow_pixel_is_not_enough_nor_a_single_grey_one_a_gap);
    RUN_TEST(the_pitch_is_green_and_nothing_else);
    RUN_TEST(grey_and_hsv_of_known_colours);
    RUN_TEST(yellowness_is_zero_for_greys_and_grows_with_the_light);
    return UNITY_END();
}
