/* Block matching: what must hold for any pictures, what takes a disparity away, and memory. That it
 * equals OpenCV is for host-tests/opencv/dense_bm_oracle.cpp to say; the last test has the hash of
 * a map of cv::StereoBM, so that other machines are held to it too. */
#include <stdlib.h>
#include <string.h>
#include <unity.h>

#include "noise.h"
#include "vision/dense_bm.h"

#define WIDTH       150
#define HEIGHT      30
#define UNTOUCHED   0x5A5A
#define WORK_CANARY 0xDEADBEEFu

static uint8_t left_pixels[HEIGHT * WIDTH];
static uint8_t right_pixels[HEIGHT * WIDTH];
static const dense_eye_t left = {{left_pixels, 0, 0}, WIDTH, HEIGHT, WIDTH};
static const dense_eye_t right = {{right_pixels, 0, 0}, WIDTH, HEIGHT, WIDTH};
static bm_params_t params;
static int16_t map[HEIGHT * WIDTH];
static uint32_t work[40000];

/* The right eye sees what the left sees `shift` further right. */
static void paint_shifted(int shift)
{
    int i;

    for (i = 0; i < HEIGHT * WIDTH; i++) {
        left_pixels[i] = noise_texture(i % WIDTH, i / WIDTH);
        right_pixels[i] = noise_texture(i % WIDTH + shift, i / WIDTH);
    }
}

static dense_error_t run(void)
{
    uint32_t words = bm_work_words(WIDTH, HEIGHT, &params);

    TEST_ASSERT_TRUE(words <= sizeof work / sizeof *work);
    return bm_map(&left, &right, &params, work, words, map, WIDTH);
}

static int can_have_disparity(int x, int y)
{
    int half = params.block / 2;

    return x >= params.disparities - 1 + half && x < WIDTH - half && y >= half && y < HEIGHT - half;
}

void setUp(void)
{
    int i;

    params = bm_defaults(9, 32);
    for (i = 0; i < HEIGHT * WIDTH; i++)
        map[i] = UNTOUCHED;
}

void tearDown(void) {}

static void assert_all(int16_t inside_q4)
{
    int i;

    for (i = 0; i < HEIGHT * WIDTH; i++)
        TEST_ASSERT_EQUAL_INT16(
            can_have_disparity(i % WIDTH, i / WIDTH) ? inside_q4 : DENSE_INVALID_Q4, map[i]);
}

/* Without the last column of blocks: there the picture's last column takes part, which has no
 * gradient. To the whole pixel: at the first columns of blocks the same is true of a
 * neighbour. */
static void assert_inside(int16_t inside_q4)
{
    int i;

    for (i = 0; i < HEIGHT * WIDTH; i++)
        if (can_have_disparity(i % WIDTH, i / WIDTH) &&
            can_have_disparity(i % WIDTH + 1, i / WIDTH))
            TEST_ASSERT_INT16_WITHIN(7, inside_q4, map[i]);
}

/* Within half a pixel: the sums on both sides differ a little. */
static void assert_shift_found(int shift)
{
    int half = params.block / 2;
    int x;
    int y;

    for (y = half; y < HEIGHT - half; y++)
        for (x = params.disparities - 1 + half; x < WIDTH - half - 1; x++)
            TEST_ASSERT_INT16_WITHIN(8, 16 * shift, map[y * WIDTH + x]);
}

static void a_shifted_picture_gives_its_shift(void)
{
    int block;
    int left_right;

    for (left_right = BM_NO_LEFT_RIGHT; left_right <= 1; left_right++) {
        for (block = BM_MIN_BLOCK; block <= (int)BM_MAX_BLOCK; block += 2) {
            params = bm_defaults((uint8_t)block, 32);
            params.left_right_max = (int16_t)left_right;
            paint_shifted(11);
            TEST_ASSERT_EQUAL(DENSE_OK, run());
            assert_shift_found(11);
        }
    }
}

static void mirror(const uint8_t *from, uint8_t *to)
{
    int i;

    for (i = 0; i < HEIGHT * WIDTH; i++)
        to[i] = from[i - i % WIDTH + WIDTH - 1 - i % WIDTH];
}

static void exchanging_and_mirroring_the_eyes_keeps_the_shift(void)
{
    static uint8_t mirrored[HEIGHT * WIDTH];

    paint_shifted(5);
    mirror(right_pixels, mirrored);
    mirror(left_pixels, right_pixels);
    memcpy(left_pixels, mirrored, sizeof mirrored);
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    assert_shift_found(5);
}

static void another_brightness_of_one_eye_changes_nothing(void)
{
    static int16_t before[HEIGHT * WIDTH];
    int i;

    paint_shifted(9);
    for (i = 0; i < HEIGHT * WIDTH; i++)
        right_pixels[i] = (uint8_t)(right_pixels[i] / 2);
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    memcpy(before, map, sizeof map);
    for (i = 0; i < HEIGHT * WIDTH; i++)
        right_pixels[i] = (uint8_t)(right_pixels[i] + 100);
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    TEST_ASSERT_EQUAL_INT16_ARRAY(before, map, HEIGHT * WIDTH);
}

/* Only of an even height: see the pre-filter. */
static void turning_both_pictures_upside_down_turns_the_map(void)
{
    static int16_t before[HEIGHT * WIDTH];
    int y;

    paint_shifted(9);
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    memcpy(before, map, sizeof map);
    for (y = 0; y < HEIGHT; y++) {
        int x;

        for (x = 0; x < WIDTH; x++) {
            left_pixels[y * WIDTH + x] = noise_texture(x, HEIGHT - 1 - y);
            right_pixels[y * WIDTH + x] = noise_texture(x + 9, HEIGHT - 1 - y);
        }
    }
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    for (y = 0; y < HEIGHT; y++)
        TEST_ASSERT_EQUAL_INT16_ARRAY(before + (HEIGHT - 1 - y) * WIDTH, map + y * WIDTH, WIDTH);
}

static void without_texture_there_is_no_disparity(void)
{
    memset(left_pixels, 77, sizeof left_pixels);
    memset(right_pixels, 99, sizeof right_pixels);
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    assert_all(DENSE_INVALID_Q4);
    params.texture_min = 0;
    params.uniqueness_percent = 0;
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    assert_all(16 * 31); /* all alike: the largest disparity */
}

static void a_pattern_that_repeats_is_ambiguous(void)
{
    int i;

    for (i = 0; i < HEIGHT * WIDTH; i++)
        left_pixels[i] = right_pixels[i] = noise_texture(i % WIDTH % 10, 3);
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    assert_inside(DENSE_INVALID_Q4);
    params.uniqueness_percent = 0;
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    assert_inside(16 * 30); /* 0, 10, 20 and 30 are equal */
}

/* A near square hides a part of the background from one eye. */
static void the_left_right_check_takes_away_what_only_one_eye_sees(void)
{
    int i;
    int hidden = 0;
    int hidden_checked = 0;

    paint_shifted(4);
    for (i = 0; i < HEIGHT * WIDTH; i++) {
        if (i % WIDTH >= 80 && i % WIDTH < 110)
            left_pixels[i] = noise_texture(i % WIDTH, i / WIDTH + 500);
        if (i % WIDTH + 24 >= 80 && i % WIDTH + 24 < 110)
            right_pixels[i] = noise_texture(i % WIDTH + 24, i / WIDTH + 500);
    }
    params.uniqueness_percent = 0;
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    for (i = 0; i < HEIGHT * WIDTH; i++)
        hidden += i % WIDTH >= 62 && i % WIDTH < 76 && map[i] >= 0;
    params.left_right_max = 1;
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    for (i = 0; i < HEIGHT * WIDTH; i++)
        hidden_checked += i % WIDTH >= 62 && i % WIDTH < 76 && map[i] >= 0;
    TEST_ASSERT_EQUAL_INT(14 * (HEIGHT - 8), hidden);
    TEST_ASSERT_TRUE(hidden_checked < hidden / 2);
    TEST_ASSERT_INT16_WITHIN(8, 16 * 24, map[15 * WIDTH + 95]); /* the square stays */
    TEST_ASSERT_INT16_WITHIN(8, 16 * 4, map[15 * WIDTH + 130]); /* and what both see */
}

static void disparities_beyond_the_width_give_an_empty_map(void)
{
    paint_shifted(0);
    params.disparities = 144; /* 150 columns have no room for 143 + 9 */
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    assert_all(DENSE_INVALID_Q4);
}

static void assert_refused(void)
{
    TEST_ASSERT_EQUAL_UINT32(0, bm_work_words(WIDTH, HEIGHT, &params));
    TEST_ASSERT_EQUAL(DENSE_BAD_PARAM,
                      bm_map(&left, &right, &params, work, sizeof work / sizeof *work, map, WIDTH));
    TEST_ASSERT_EQUAL_INT16(UNTOUCHED, map[0]);
    params = bm_defaults(9, 32);
}

static void wrong_parameters_are_refused_and_nothing_is_written(void)
{
    dense_eye_t small = left;

    params.block = 8;
    assert_refused();
    params.block = 3;
    assert_refused();
    params.block = 23;
    assert_refused();
    params.disparities = 0;
    assert_refused();
    params.disparities = 40;
    assert_refused();
    params.disparities = DENSE_MAX_DISPARITIES + 16;
    assert_refused();
    params.prefilter_cap = 0;
    assert_refused();
    params.prefilter_cap = 64;
    assert_refused();
    params.uniqueness_percent = 101;
    assert_refused();
    small.height = 9; /* OpenCV wants more than a block */
    TEST_ASSERT_EQUAL(DENSE_TOO_SMALL, bm_map(&small, &small, &params, work,
                                              sizeof work / sizeof *work, map, WIDTH));
    TEST_ASSERT_EQUAL(DENSE_NO_MEMORY,
                      bm_map(&left, &right, &params, work,
                             bm_work_words(WIDTH, HEIGHT, &params) - 1, map, WIDTH));
    TEST_ASSERT_EQUAL_INT16(UNTOUCHED, map[0]);
}

static uint8_t *noise_plane(uint32_t size, uint32_t *seed)
{
    uint8_t *plane = malloc(size);
    uint32_t i;

    TEST_ASSERT_NOT_NULL(plane);
    for (i = 0; i < size; i++)
        plane[i] = (uint8_t)noise_next(seed);
    return plane;
}

static void random_params(uint32_t *state)
{
    params.block = (uint8_t)(5 + 2 * noise_between(state, 0, 8));
    params.disparities = (uint16_t)(16 * noise_between(state, 1, 6));
    params.prefilter_cap = (uint8_t)noise_between(state, 1, BM_MAX_PREFILTER_CAP);
    params.uniqueness_percent = (uint8_t)noise_between(state, 0, 30);
    params.texture_min = (uint16_t)noise_between(state, 0, 600);
    params.left_right_max = (int16_t)((int)noise_between(state, 0, 3) - 1);
}

/* Memory of exactly the size asked for: sanitizers see the first byte beyond. */
static void one_random_case(uint32_t seed)
{
    uint32_t state = seed;
    dense_eye_t eyes[2];
    uint32_t size;
    uint32_t words;
    uint32_t *memory;
    int16_t *out;
    uint32_t i;

    random_params(&state);
    eyes[0].width = (uint16_t)noise_between(&state, 1, 180);
    eyes[0].height = (uint16_t)noise_between(&state, 1, 40);
    eyes[1] = eyes[0];
    eyes[0].stride = (uint16_t)(eyes[0].width + noise_between(&state, 0, 5));
    eyes[1].stride = (uint16_t)(eyes[0].width + noise_between(&state, 0, 5));
    for (i = 0; i < 2; i++)
        eyes[i].planes[0] =
            noise_plane((uint32_t)(eyes[i].height - 1) * eyes[i].stride + eyes[i].width, &state);
    size = (uint32_t)(eyes[0].height - 1) * eyes[0].stride + eyes[0].width;
    words = bm_work_words(eyes[0].width, eyes[0].height, &params);
    memory = malloc((words + 1) * sizeof *memory);
    out = malloc(size * sizeof *out);
    TEST_ASSERT_NOT_NULL(memory);
    TEST_ASSERT_NOT_NULL(out);
    memory[words] = WORK_CANARY;
    for (i = 0; i < size; i++)
        out[i] = UNTOUCHED;
    bm_map(&eyes[0], &eyes[1], &params, memory, words, out, eyes[0].stride);
    TEST_ASSERT_EQUAL_HEX32(WORK_CANARY, memory[words]);
    for (i = 0; i < size; i++) {
        if (i % eyes[0].stride >= eyes[0].width)
            TEST_ASSERT_EQUAL_INT16(UNTOUCHED, out[i]);
        else if (out[i] != UNTOUCHED && out[i] != DENSE_INVALID_Q4)
            TEST_ASSERT_TRUE(out[i] >= 0 && out[i] <= 16 * (params.disparities - 1));
    }
    free((void *)(uintptr_t)eyes[0].planes[0]);
    free((void *)(uintptr_t)eyes[1].planes[0]);
    free(memory);
    free(out);
}

static void any_size_stride_and_parameter_stays_in_bounds(void)
{
    static char message[] = "replay: seed 000";
    uint32_t seed;

    for (seed = 1; seed <= 150; seed++) {
        message[13] = (char)('0' + seed / 100);
        message[14] = (char)('0' + seed / 10 % 10);
        message[15] = (char)('0' + seed % 10);
        UnitySetTestFile(message);
        one_random_case(seed);
    }
    UnitySetTestFile(__FILE__);
}

static void every_machine_computes_the_map_that_equals_opencv(void)
{
    uint32_t seed = 2024;
    uint32_t hash = 2166136261u; /* FNV-1a */
    int i;

    paint_shifted(13);
    for (i = 0; i < HEIGHT * WIDTH; i++)
        right_pixels[i] = (uint8_t)(right_pixels[i] - noise_between(&seed, 0, right_pixels[i] / 8));
    params.left_right_max = 1;
    TEST_ASSERT_EQUAL(DENSE_OK, run());
    for (i = 0; i < HEIGHT * WIDTH; i++) {
        hash = (hash ^ ((uint16_t)map[i] & 0xFF)) * 16777619u;
        hash = (hash ^ ((uint16_t)map[i] >> 8)) * 16777619u;
    }
    TEST_ASSERT_EQUAL_HEX32(0x43784915, hash);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_shifted_picture_gives_its_shift);
    RUN_TEST(exchanging_and_mirroring_the_eyes_keeps_the_shift);
    RUN_TEST(another_brightness_of_one_eye_changes_nothing);
    RUN_TEST(turning_both_pictures_upside_down_turns_the_map);
    RUN_TEST(without_texture_there_is_no_disparity);
    RUN_TEST(a_pattern_that_repeats_is_ambiguous);
    RUN_TEST(the_left_right_check_takes_away_what_only_one_eye_sees);
    RUN_TEST(disparities_beyond_the_width_give_an_empty_map);
    RUN_TEST(wrong_parameters_are_refused_and_nothing_is_written);
    RUN_TEST(any_size_stride_and_parameter_stays_in_bounds);
    RUN_TEST(every_machine_computes_the_map_that_equals_opencv);
    return UNITY_END();
}
