#include "painted_scene.h"

#include "vision/color.h"

const paint_t PAINT_WALL = {104, 104, 104};
const paint_t PAINT_PITCH = {56, 132, 72};
const paint_t PAINT_BLACK = {12, 12, 12};
const paint_t PAINT_WHITE = {176, 176, 176};
const paint_t PAINT_YELLOW = {200, 184, 48};
const paint_t PAINT_PINK = {232, 120, 160};

uint16_t scene_pixels[EYE_COUNT][CAMERA_HEIGHT_PX * CAMERA_WIDTH_PX];
const frame_pair_t scene_frames = {{scene_pixels[EYE_LEFT], scene_pixels[EYE_RIGHT]}};

static int left_row_shift;

static int clamped(int value)
{
    if (value < 0)
        return 0;
    return value > 255 ? 255 : value;
}

static uint16_t packed(int red, int green, int blue)
{
    return (uint16_t)((clamped(red) >> 3) << 11 | (clamped(green) >> 2) << 5 | clamped(blue) >> 3);
}

/* Blend `paint` over the pixel, `cover` of 16 parts. */
static void blend(int eye, int x, int y, paint_t paint, int32_t cover)
{
    uint16_t *pixel;

    if (cover <= 0 || x < 0 || x >= CAMERA_WIDTH_PX || y < 0 || y >= CAMERA_HEIGHT_PX)
        return;
    pixel = &scene_pixels[eye][y * CAMERA_WIDTH_PX + x];
    *pixel = packed((COLOR_RED(*pixel) * (16 - cover) + paint.red * cover) / 16,
                    (COLOR_GREEN(*pixel) * (16 - cover) + paint.green * cover) / 16,
                    (COLOR_BLUE(*pixel) * (16 - cover) + paint.blue * cover) / 16);
}

/* The part of pixel x that lies between both edges, 0..16. */
static int32_t covered(int x, int32_t x0_q4, int32_t x1_q4)
{
    int32_t from = 16 * (int32_t)x - 8;
    int32_t to = from + 16;

    if (from < x0_q4)
        from = x0_q4;
    if (to > x1_q4)
        to = x1_q4;
    return to - from;
}

static void span(int eye, int row, paint_t paint, int32_t x0_q4, int32_t x1_q4)
{
    int x;

    for (x = 0; x < CAMERA_WIDTH_PX; x++)
        blend(eye, x, row + (eye == EYE_LEFT ? left_row_shift : 0), paint,
              covered(x, x0_q4, x1_q4));
}

void scene_clear(int misalignment)
{
    const int32_t beyond_q4 = 16 * CAMERA_WIDTH_PX;
    int row;

    left_row_shift = misalignment;
    for (row = -2; row < CAMERA_HEIGHT_PX + 2; row++) {
        paint_t paint = row < SCENE_FOOT_ROW ? PAINT_WALL : PAINT_PITCH;

        span(EYE_LEFT, row, paint, -16, beyond_q4);
        span(EYE_RIGHT, row, paint, -16, beyond_q4);
    }
}

void scene_bar(paint_t paint, int32_t x0_q4, int32_t x1_q4, int top, int bottom, int32_t d_q4)
{
    int row;

    for (row = top; row <= bottom; row++) {
        span(EYE_RIGHT, row, paint, x0_q4, x1_q4);
        span(EYE_LEFT, row, paint, x0_q4 + d_q4, x1_q4 + d_q4);
    }
}

static int32_t square_root(int32_t value)
{
    int32_t root = 0;

    while ((root + 1) * (root + 1) <= value)
        root++;
    return root;
}

void scene_disc(paint_t paint, int32_t x_q4, int32_t y_q4, int32_t radius_q4, int32_t d_q4)
{
    int32_t row;

    for (row = (y_q4 - radius_q4) / 16; row <= (y_q4 + radius_q4) / 16 + 1; row++) {
        int32_t dy = 16 * row - y_q4;
        int32_t square = radius_q4 * radius_q4 - dy * dy;
        int32_t half;

        if (square <= 0)
            continue;
        half = square_root(square);
        span(EYE_RIGHT, (int)row, paint, x_q4 - half, x_q4 + half);
        span(EYE_LEFT, (int)row, paint, x_q4 + d_q4 - half, x_q4 + d_q4 + half);
    }
}

void scene_stripes(int32_t x0_q4, int32_t stripe_q4, int count, int top, int bottom, int32_t d_q4)
{
    int i;

    for (i = 0; i < count; i++)
        scene_bar(i & 1 ? PAINT_WHITE : PAINT_BLACK, x0_q4 + i * stripe_q4,
                  x0_q4 + (i + 1) * stripe_q4, top, bottom, d_q4);
}

void scene_noise(int eye, int amplitude, uint32_t seed)
{
    int32_t i;
    int channel;

    for (i = 0; i < CAMERA_WIDTH_PX * (int32_t)CAMERA_HEIGHT_PX; i++) {
        uint16_t pixel = scene_pixels[eye][i];
        int noise[3];

        for (channel = 0; channel < 3; channel++) {
            /* Numerical Recipes' generator; its high bits are good enough here. */
            seed = seed * 1664525u + 1013904223u;
            noise[channel] = (int)((seed >> 16) % (uint32_t)(2 * amplitude + 1)) - amplitude;
        }
        scene_pixels[eye][i] = packed(COLOR_RED(pixel) + noise[0], COLOR_GREEN(pixel) + noise[1],
                                      COLOR_BLUE(pixel) + noise[2]);
    }
}

void scene_gain(int eye, int percent)
{
    int32_t i;

    for (i = 0; i < CAMERA_WIDTH_PX * (int32_t)CAMERA_HEIGHT_PX; i++) {
        uint16_t pixel = scene_pixels[eye][i];

        scene_pixels[eye][i] =
            packed(COLOR_RED(pixel) * percent / 100, COLOR_GREEN(pixel) * percent / 100,
                   COLOR_BLUE(pixel) * percent / 100);
    }
}
