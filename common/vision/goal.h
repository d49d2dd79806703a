/* The goal: a black run on its epipolar line (row 60 by default) and its edges.
 *
 * The rays of that row leave the lens level, so they meet a wall or a goal about 95..105 mm high at
 * any distance, above the ball and every line of the floor. An edge of the goal is where grey wall
 * turns black: much darker on one side, both sides wide enough, and no stripe of the opponent. Each
 * edge is matched as the paper does: the 8x8 block at the edge in the right image against the left
 * image, SAD, 0..search_max, up to match_rows off. The place found must be an edge of the same
 * kind; the disparity is the difference of both edges, each placed between pixels. (The paper's
 * parabola through three sums would be pulled aside whenever one eye is brighter than the other.)
 *
 * Either edge may be hidden or out of the picture, but then at least 75 mm of black must be seen
 * beside the other; two edges must be about 300 mm apart.
 *
 * What the hardware would hold: the band (vision/band.h), one accumulator. */
#ifndef VISION_GOAL_H
#define VISION_GOAL_H

#include <stdint.h>

#include "link/report.h"
#include "vision/band.h"
#include "vision/opponent.h"

/* Fill the goal's fields and flags of *report from the band around the goal's row. `opponent`: what
 * of the right image the opponent covers. */
void goal_find(const band_t *band, const eye_params_t *params, const opponent_extent_t *opponent,
               report_t *report);

#endif
