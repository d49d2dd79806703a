/* The frame memory: the pair of frames that the eye has just taken.
 *
 * On the turret this is the PSRAM. The kernels read it by whole rows, top to bottom within one
 * object, and only in robot_eye_end; so a hardware version needs one row buffer and one burst per
 * call of frame_row. */
#ifndef VISION_FRAME_H
#define VISION_FRAME_H

#include <stdint.h>

#include "vision/camera.h"

enum { EYE_LEFT = 0, EYE_RIGHT = 1, EYE_COUNT = 2 };

typedef struct {
    /* CAMERA_WIDTH_PX * CAMERA_HEIGHT_PX RGB565 pixels each, row by row. */
    const uint16_t *pixels[EYE_COUNT];
} frame_pair_t;

/* The eyes see CAMERA_WIDTH_PX x CAMERA_HEIGHT_PX. When the cameras give twice that each way, two
 * of their rows make one of the eye's: each pixel the mean of four, channel by channel, rounded
 * half up. `upper` and `lower` have 2 * CAMERA_WIDTH_PX RGB565 pixels, `row` takes CAMERA_WIDTH_PX.
 *
 * What the hardware would hold: one row of 320 sums of two pixels, three channels each. */
void frame_halve_rows(const uint16_t *upper, const uint16_t *lower, uint16_t *row);

/* The row of that eye; a row outside the frame is the nearest one inside. */
const uint16_t *frame_row(const frame_pair_t *frames, int eye, int row);

#endif
