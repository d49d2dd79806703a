/* The ball: the largest yellow strip in row and column, in both eyes (paper, section 4.2).
 *
 * While the rows stream by, each eye collects its yellow blobs (vision/strips.h). At the end, pairs
 * of blobs that can be a ball are weighed: same rows in both eyes, a width of 67/50.4 of the
 * disparity, a centre about half a ball above the floor (a yellow thing beyond the wall hangs in
 * the air). The best pair's outline is then read again from the frame memory: in up to
 * BALL_MAX_ROWS rows around the middle, both ends of the strip are placed between pixels where
 * the yellowness crosses the middle between inside and outside. The disparity is the mean of what
 * the left and the right ends say; an end at the frame's border or behind something does not count.
 *
 * A sphere's outline is an ellipse whose middle lies further out than the image of the sphere's
 * centre, by 1 / (1 - (R/Z)^2): 2 % at the near end. Disparity and x are corrected for it.
 *
 * A ball nearer than the search range, or so near that it is cut by the lower border, is reported
 * as clipped: x is the middle of its strip as far as it can be seen, disparity 0.
 *
 * What the hardware would hold: 2 * sizeof(strips_t), and at the end 4 * BALL_MAX_ROWS ends. */
#ifndef VISION_BALL_H
#define VISION_BALL_H

#include <stdint.h>

#include "link/report.h"
#include "vision/frame.h"
#include "vision/strips.h"

#define BALL_MAX_ROWS 32

typedef struct {
    strips_t strips[EYE_COUNT];
    const eye_params_t *params;
} ball_finder_t;

/* Start a pair of frames. `params` are used until its end. */
void ball_begin(ball_finder_t *finder, const eye_params_t *params);

/* Take the next row of both eyes, CAMERA_WIDTH_PX RGB565 pixels each. */
void ball_row(ball_finder_t *finder, uint8_t row, const uint16_t *left, const uint16_t *right);

/* Fill the ball's fields and flags of *report, which the caller has set to 0. Reads at most
 * 2 * BALL_MAX_ROWS rows of the frame memory. */
void ball_end(const ball_finder_t *finder, const frame_pair_t *frames, report_t *report);

#endif
