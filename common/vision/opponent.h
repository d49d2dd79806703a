/* The opponent: the black and white strip on its epipolar line (row 80 by default).
 *
 * Its dress shows an alternation of black and white stripes, at most stripe_max wide (the reference
 * scene's are 11.8 mm), neutral in colour. In the right eye the detector gathers edges that follow
 * each other so, and compares the whole strip with the left eye (SAD over the strip's width and the
 * 8 block rows): the ends of the strip tell one period of the stripes from the next, which an 8x8
 * block alone cannot. Stripe edges near the strip's middle, placed between pixels in both eyes,
 * then give the disparity of the nearest surface; those to its side are farther, and corrected for
 * the body's curvature.
 *
 * What the hardware would hold: the band (vision/band.h), one accumulator a candidate. */
#ifndef VISION_OPPONENT_H
#define VISION_OPPONENT_H

#include <stdint.h>

#include "link/report.h"
#include "vision/band.h"

typedef struct {
    uint8_t seen;     /* 1: the columns below hold a striped body, whether or not it was matched */
    int16_t first_q4; /* columns of the right image, with a margin for stripes lost at its ends */
    int16_t last_q4;
} opponent_extent_t;

/* Fill the opponent's fields and flag of *report, and *extent, from the band around the opponent's
 * row. */
void opponent_find(const band_t *band, const eye_params_t *params, report_t *report,
                   opponent_extent_t *extent);

#endif
