#include "vision/color.h"

#include "vision/multiversion.h"

/* Weights of ITU-R BT.601 in 1/32768: .299, .587, .114, as OpenCV rounds them. */
#define GREY_RED   9798u
#define GREY_GREEN 19235u
#define GREY_BLUE  3735u

uint8_t color_grey(uint8_t red, uint8_t green, uint8_t blue)
{
    return (uint8_t)((GREY_RED * red + GREY_GREEN * green + GREY_BLUE * blue + (1u << 14)) >> 15);
}

uint8_t color_grey565(uint16_t rgb565)
{
    return color_grey((uint8_t)COLOR_RED(rgb565), (uint8_t)COLOR_GREEN(rgb565),
                      (uint8_t)COLOR_BLUE(rgb565));
}

/* numerator * 4096 / divisor, rounded half up; OpenCV's tables hold the same quotients. */
static int32_t reciprocal(int32_t numerator, int32_t divisor)
{
    return ((numerator << 13) / divisor + 1) >> 1;
}

hsv_t color_hsv(uint8_t red, uint8_t green, uint8_t blue)
{
    hsv_t hsv = {0, 0, 0};
    int32_t highest = red;
    int32_t lowest = red;
    int32_t spread;
    int32_t sector;

    if (green > highest)
        highest = green;
    if (blue > highest)
        highest = blue;
    if (green < lowest)
        lowest = green;
    if (blue < lowest)
        lowest = blue;
    spread = highest - lowest;
    hsv.value = (uint8_t)highest;
    if (spread == 0)
        return hsv;

    hsv.saturation = (uint8_t)((spread * reciprocal(255, highest) + (1 << 11)) >> 12);
    if (highest == red)
        sector = green - blue;
    else if (highest == green)
        sector = blue - red + 2 * spread;
    else
        sector = red - green + 4 * spread;
    /* A sixth of the circle is 30 units wide. The sum may be negative: halves round up there too,
     * by the offset of a whole circle. */
    sector = ((sector * reciprocal(30, spread) + (1 << 11) + 180 * 4096) >> 12) - 180;
    hsv.hue = (uint8_t)(sector < 0 ? sector + 180 : sector);
    return hsv;
}

int16_t color_yellowness(uint16_t rgb565)
{
    return (int16_t)(COLOR_RED(rgb565) + COLOR_GREEN(rgb565) - 2 * COLOR_BLUE(rgb565));
}

static uint8_t is_yellow(int pixels, int red, int green, int blue, const eye_params_t *params)
{
    return (uint8_t)((red + green - 3 * blue > pixels * params->yellow_margin) &
                     (100 * red > params->yellow_red * green) &
                     (100 * green > params->yellow_green * red));
}

MULTIVERSION
void color_yellow_mask(const uint16_t *rgb565, uint16_t width, const eye_params_t *params,
                       uint8_t *mask)
{
    uint16_t x;

    for (x = 1; x + 1 < width; x++) {
        uint16_t a = rgb565[x - 1];
        uint16_t b = rgb565[x];
        uint16_t c = rgb565[x + 1];

        mask[x] = is_yellow(3, COLOR_RED(a) + COLOR_RED(b) + COLOR_RED(c),
                            COLOR_GREEN(a) + COLOR_GREEN(b) + COLOR_GREEN(c),
                            COLOR_BLUE(a) + COLOR_BLUE(b) + COLOR_BLUE(c), params);
    }
    mask[0] = mask[1];
    mask[width - 1] = mask[width - 2];
}

int color_is_pitch(uint16_t pixels, uint16_t red_sum, uint16_t green_sum, uint16_t blue_sum,
                   const eye_params_t *params)
{
    int32_t red = red_sum;
    int32_t green = green_sum;
    int32_t blue = blue_sum;

    return 4 * (green - red) > green && green - red > pixels * params->pitch_margin &&
           8 * (green - blue) > green;
}
