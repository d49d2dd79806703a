/* Pairs of frames painted in integers, for the tests of the detectors: a grey wall, the green
 * pitch, and flat things put at a stated place and disparity. Edges between pixels are blended. */
#ifndef PAINTED_SCENE_H
#define PAINTED_SCENE_H

#include <stdint.h>

#include "vision/frame.h"

#define SCENE_FOOT_ROW 100 /* of the wall, in every column */

typedef struct {
    uint8_t red;
    uint8_t green;
    uint8_t blue;
} paint_t;

extern const paint_t PAINT_WALL;
extern const paint_t PAINT_PITCH;
extern const paint_t PAINT_BLACK;
extern const paint_t PAINT_WHITE;
extern const paint_t PAINT_YELLOW;
extern const paint_t PAINT_PINK;

/* The pair, and the same as the kernels want it. One at a time. */
extern uint16_t scene_pixels[EYE_COUNT][CAMERA_HEIGHT_PX * CAMERA_WIDTH_PX];
extern const frame_pair_t scene_frames;

/* Wall and pitch in both eyes; the left eye's rows are `misalignment` lower from now on. */
void scene_clear(int misalignment);

/* A rectangle of rows top..bottom whose vertical edges are at x0 and x1 in the right eye (1/16 px,
 * pixel centres at multiples of 16) and d_q4 further right in the left one. */
void scene_bar(paint_t paint, int32_t x0_q4, int32_t x1_q4, int top, int bottom, int32_t d_q4);

/* A disc. */
void scene_disc(paint_t paint, int32_t x_q4, int32_t y_q4, int32_t radius_q4, int32_t d_q4);

/* A body of `count` stripes, black and white in turn, flat, from x0 on, each stripe_q4 wide. */
void scene_stripes(int32_t x0_q4, int32_t stripe_q4, int count, int top, int bottom, int32_t d_q4);

/* Add noise of +-amplitude to every channel of one eye, the same for the same seed. */
void scene_noise(int eye, int amplitude, uint32_t seed);

/* Multiply one eye's channels by percent / 100. */
void scene_gain(int eye, int percent);

#endif
