/* Whether a camera's exposure is settled, from its pictures alone: the FPGA is not told what the
 * camera controls by itself.
 *
 * The mean green of a whole frame is compared with that of the one before. By the robot's own
 * turning it changes by some percent; a lamp that is switched, or a setting that is changed, moves
 * it by more than a quarter at once. From then on the exposure counts as unsettled until
 * EXPOSURE_CALM_FRAMES in a row differ by less than 1/32 each, half of the smallest step that a
 * camera of the OV7670's kind makes, or until EXPOSURE_MAX_FRAMES have passed: what goes on then is
 * the scene's.
 *
 * What the hardware would hold: two sums and two counters an eye. */
#ifndef VISION_EXPOSURE_H
#define VISION_EXPOSURE_H

#include <stdint.h>

#define EXPOSURE_CALM_FRAMES 4u
#define EXPOSURE_MAX_FRAMES  40u

typedef struct {
    uint32_t sum;        /* of green, of the frame that is coming in */
    uint32_t before;     /* of the last whole one; 0: there was none, or a black one */
    uint8_t calm;        /* frames in a row that changed little */
    uint8_t frames_left; /* 0: settled; else it is unsettled for so many frames at most */
} exposure_watch_t;

/* A camera that was never seen: settled. */
void exposure_reset(exposure_watch_t *watch);

/* Take the next row, CAMERA_WIDTH_PX RGB565 pixels. */
void exposure_row(exposure_watch_t *watch, const uint16_t *rgb565);

/* The frame is over. Returns 1 if the exposure is unsettled, with this frame, else 0. */
int exposure_end(exposure_watch_t *watch);

#endif
