/* Colour in integers.
 *
 * Pixels of the robot are RGB565: red in bits 15..11, green in 10..5, blue in 4..0. Their channels
 * on the scale of 8 bits have the missing low bits 0, as in OpenCV.
 *
 * What the hardware would hold: adders and comparators, no memory. */
#ifndef VISION_COLOR_H
#define VISION_COLOR_H

#include <stdint.h>

#include "link/registers.h"

#define COLOR_RED(rgb565)   (((rgb565) >> 8) & 0xF8)
#define COLOR_GREEN(rgb565) (((rgb565) >> 3) & 0xFC)
#define COLOR_BLUE(rgb565)  (((rgb565) << 3) & 0xF8)

/* Grey of an 8-bit colour, equal to cv::cvtColor(COLOR_RGB2GRAY) for every colour. */
uint8_t color_grey(uint8_t red, uint8_t green, uint8_t blue);

/* Grey of an RGB565 pixel, equal to cv::cvtColor(COLOR_BGR5652GRAY). */
uint8_t color_grey565(uint16_t rgb565);

typedef struct {
    uint8_t hue;        /* 0..179, units of 2 degrees; 0 for greys */
    uint8_t saturation; /* 0..255 */
    uint8_t value;      /* 0..255 */
} hsv_t;

/* HSV of an 8-bit colour, equal to cv::cvtColor(COLOR_RGB2HSV) for every colour. */
hsv_t color_hsv(uint8_t red, uint8_t green, uint8_t blue);

/* How yellow a colour is: red + green - 2 blue. Linear, so that edges of the ball can be placed
 * between pixels; 0 for greys. Range -510..510. */
int16_t color_yellowness(uint16_t rgb565);

/* Mark the pixels of a row that are yellow as the ball is: mask[x] = 1, else 0, of the mean of
 * pixels x-1, x, x+1; the first and last column repeat their neighbour. width >= 3.
 *
 * The test has no division: with R, G, B the means,
 *   R + G - 3 B > yellow_margin   far enough from grey, and brighter than the dark's noise
 *   R > yellow_red G              not green: 80 % is a hue below 72 degrees
 *   G > yellow_green R            not orange or skin: 60 % is a hue above 36 degrees at B = 0
 * In HSV: saturation above 1/3 at equal red and green, rising with darkness because of the margin;
 * the hue limits move by up to 20 degrees with the saturation, which an HSV box would not do. A
 * margin of 0 takes every tint. */
void color_yellow_mask(const uint16_t *rgb565, uint16_t width, const eye_params_t *params,
                       uint8_t *mask);

/* 1 if sums over `pixels` (1..16) pixels are green as the pitch: green exceeds red by a quarter of
 * itself and by pitch_margin a pixel, and blue by an eighth. The margin keeps out black, whose
 * green has a finer last bit than its red and blue. */
int color_is_pitch(uint16_t pixels, uint16_t red_sum, uint16_t green_sum, uint16_t blue_sum,
                   const eye_params_t *params);

#endif
