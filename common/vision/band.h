/* A band: the rows around an epipolar line, in both eyes, as the block matching needs them.
 *
 * The 8x8 blocks of the paper stand on rows -4..+3 of the line; the other eye may sit up to two
 * rows off, so rows -6..+5 are kept. Vertical edges (goal posts, stripes) are found in the profile,
 * the sum of each column over the eight block rows: noise falls by the root of eight, and an
 * error of two rows does no harm.
 *
 * What the hardware would hold: sizeof(band_t), about 10 KiB, filled by 24 row reads. The same
 * memory serves one line after the other. */
#ifndef VISION_BAND_H
#define VISION_BAND_H

#include <stdint.h>

#include "link/registers.h"
#include "vision/frame.h"

#define BLOCK_SIZE        8
#define BAND_MISALIGNMENT 2 /* rows the left eye may be off; most that match_rows takes */
#define BAND_ROWS_ABOVE   (BLOCK_SIZE / 2 + BAND_MISALIGNMENT)
#define BAND_ROWS         (BLOCK_SIZE + 2 * BAND_MISALIGNMENT)
#define BAND_LINE         BAND_ROWS_ABOVE /* index of the epipolar line within the band */
#define BAND_MAX_EDGES    64

/* A vertical edge of the profile. Levels are sums over BLOCK_SIZE rows of grey, 0..2040. */
typedef struct {
    int16_t x_q4;   /* where the profile crosses the middle between both levels */
    int16_t before; /* level left of it */
    int16_t after;  /* level right of it */
} band_edge_t;

typedef struct {
    uint8_t count;
    band_edge_t edges[BAND_MAX_EDGES]; /* from left to right */
} band_edges_t;

typedef struct {
    uint8_t grey[EYE_COUNT][BAND_ROWS][CAMERA_WIDTH_PX];
    int16_t profile[EYE_COUNT][CAMERA_WIDTH_PX];
    int16_t yellowness[EYE_COUNT][CAMERA_WIDTH_PX]; /* sums over the block rows, -4080..4080 */
    band_edges_t edges[EYE_COUNT];
} band_t;

/* Fill the band around `row` (4..235) and find its edges, steeper than edge_min of `params`. */
void band_load(band_t *band, const frame_pair_t *frames, uint8_t row, const eye_params_t *params);

/* The edge of `eye` nearest to x_q4 that rises (rising = 1) or falls (0), or 0 if there is none
 * within reach_q4. */
const band_edge_t *band_nearest_edge(const band_t *band, int eye, int16_t x_q4, int rising,
                                     int16_t reach_q4);

#define band_edge_rises(edge) ((edge)->after > (edge)->before)

#endif
