/* Yellow strips: the runs of yellow pixels of each row, joined into blobs as the rows stream by.
 *
 * The paper takes the largest yellow strip in row and column for the ball. A strip of a real tennis
 * ball is broken by its seam, and yellow things stand beyond the wall; so short gaps are closed,
 * strips that touch from row to row are joined, and the few largest blobs are kept for the ball
 * detector to choose from.
 *
 * What the hardware would hold: STRIPS_BLOBS blobs an eye, 18 bytes each, and one row of mask. */
#ifndef VISION_STRIPS_H
#define VISION_STRIPS_H

#include <stdint.h>

#include "link/registers.h"

#define STRIPS_BLOBS 8u

typedef struct {
    uint16_t last_first; /* columns of its lowest strip so far */
    uint16_t last_last;
    uint16_t outermost_first; /* leftmost and rightmost column of any strip */
    uint16_t outermost_last;
    uint16_t first; /* the second leftmost and rightmost: one noisy row does not widen the blob */
    uint16_t last;
    uint16_t width_px; /* its widest strip */
    uint8_t top_row;   /* rows of its highest and lowest strip */
    uint8_t bottom_row;
    uint16_t strips; /* 0: the place is free */
} blob_t;

typedef struct {
    blob_t blobs[STRIPS_BLOBS];
} strips_t;

/* Start a frame. */
void strips_begin(strips_t *strips);

/* Take row `row` of CAMERA_WIDTH_PX RGB565 pixels; rows from top to bottom. */
void strips_row(strips_t *strips, uint8_t row, const uint16_t *rgb565, const eye_params_t *params);

/* Next yellow strip at or right of *x in `mask` (CAMERA_WIDTH_PX entries, 1 = yellow), gaps of up
 * to gap_min_px closed, and longer ones in long strips. Returns 1 and fills first, last column and
 * *x for the next call, or 0 when none is left. */
int strips_next(const uint8_t *mask, uint8_t gap_min_px, uint16_t *x, uint16_t *first,
                uint16_t *last);

#endif
