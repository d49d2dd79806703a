// sources: khepera-firmware/soccer/angle.c
// includes: khepera-firmware
/* Fixed-point trigonometry against the host's floating point, over every angle there is. */
#include "soccer/angle.h"

#include <math.h>
#include <unity.h>

#define PI 3.14159265358979

void setUp(void) {}

void tearDown(void) {}

static void sine_and_cosine_are_right_for_every_angle(void)
{
    int32_t turn;
    double worst = 0;

    for (turn = -32768; turn < 32768; turn++) {
        double angle = turn * PI / 32768;

        worst = fmax(worst, fabs(angle_sin_q14((angle_t)turn) / 16384.0 - sin(angle)));
        worst = fmax(worst, fabs(angle_cos_q14((angle_t)turn) / 16384.0 - cos(angle)));
    }
    TEST_ASSERT_TRUE_MESSAGE(worst < 1.0 / 8000, "sine or cosine off by 1/8000 or more");
}

static void directions_are_right_all_around(void)
{
    static const double lengths[] = {1000, 8000, 200000, 2000000000};
    double worst = 0;
    int32_t step;
    unsigned i;

    for (i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
        for (step = -5000; step < 5000; step++) {
            double angle = step * PI / 5000;
            int32_t x = (int32_t)lround(lengths[i] * cos(angle));
            int32_t y = (int32_t)lround(lengths[i] * sin(angle));
            double found = angle_of(x, y) * PI / 32768;
            double error = fabs(remainder(found - atan2(y, x), 2 * PI));

            worst = fmax(worst, error);
        }
    }
    TEST_ASSERT_TRUE_MESSAGE(worst < 0.02 * PI / 180, "a direction is off by 0.02 degrees or more");
}

static void directions_along_the_axes_are_exact(void)
{
    TEST_ASSERT_EQUAL_INT(0, angle_of(0, 0));
    TEST_ASSERT_EQUAL_INT(0, angle_of(5, 0));
    TEST_ASSERT_EQUAL_INT(ANGLE_90, angle_of(0, 1));
    TEST_ASSERT_EQUAL_INT(-ANGLE_90, angle_of(0, -70000));
    TEST_ASSERT_EQUAL_INT(-32768, angle_of(-3, 0));
}

static void lengths_are_right_within_one(void)
{
    int32_t x;

    for (x = -40000; x <= 40000; x += 123) {
        double right = hypot(x, 12345 - x);
        double found = length_of(x, 12345 - x);

        TEST_ASSERT_TRUE(found <= right && found > right - 3);
    }
}

static void square_roots_are_rounded_down(void)
{
    uint32_t root;

    for (root = 1; root < 65536; root += 7) {
        TEST_ASSERT_EQUAL_UINT32(root, square_root(root * root));
        TEST_ASSERT_EQUAL_UINT32(root - 1, square_root(root * root - 1));
    }
    TEST_ASSERT_EQUAL_UINT32(65535, square_root(UINT32_MAX));
}

static void degrees_survive_the_way_there_and_back(void)
{
    int32_t degrees;

    for (degrees = -179; degrees <= 179; degrees++)
        TEST_ASSERT_EQUAL_INT(degrees, angle_to_degrees(angle_from_degrees(degrees)));
    TEST_ASSERT_EQUAL_INT(-180, angle_to_degrees(angle_from_degrees(180)));
}

static void within_is_what_the_length_says(void)
{
    static const int32_t far[] = {0, 1, 99, 100, 101, 140, 5000, 40000, -30, -100, -200};
    const unsigned count = sizeof far / sizeof far[0];
    unsigned i;
    unsigned j;
    uint32_t radius;

    for (i = 0; i < count; i++)
        for (j = 0; j < count; j++)
            for (radius = 0; radius <= 6000; radius += radius < 300 ? 1 : 377)
                TEST_ASSERT_EQUAL_INT(length_of(far[i], far[j]) < radius,
                                      is_within(far[i], far[j], radius));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(sine_and_cosine_are_right_for_every_angle);
    RUN_TEST(directions_are_right_all_around);
    RUN_TEST(directions_along_the_axes_are_exact);
    RUN_TEST(lengths_are_right_within_one);
    RUN_TEST(square_roots_are_rounded_down);
    RUN_TEST(degrees_survive_the_way_there_and_back);
    RUN_TEST(within_is_what_the_length_says);
    return UNITY_END();
}
