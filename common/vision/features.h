/* Feature-based matching, the paper's second class: edges with location, strength and orientation,
 * found by the Sobel filter and matched along the epipolar row.
 *
 * Sparse but quick: a row has some dozen edges where a dense map has 320 blocks. All functions are
 * pure and use 32-bit integers only.
 *
 * What the hardware would hold: three rows of grey, one list of edges an eye. */
#ifndef VISION_FEATURES_H
#define VISION_FEATURES_H

#include <stdint.h>

#include "vision/correspondence.h"

#define FEATURE_ORIENTATIONS 16u /* of 22.5 degrees each */

/* The Sobel gradient of a pixel, -1020..1020 each: gx grows to the right, gy downwards. */
typedef struct {
    int16_t gx;
    int16_t gy;
} gradient_t;

/* Gradient at (x, y); the border repeats its mirror image without the edge pixel, as cv::Sobel does
 * by default. width and height >= 2. */
gradient_t sobel_at(const image_view_t *view, int x, int y);

/* Direction in which brightness grows: 0 = right, 4 = down, 8 = left, 12 = up; limits between two
 * sectors at odd multiples of 11.25 degrees, accurate to 0.1 degree. 0 for no gradient. */
uint8_t gradient_orientation(gradient_t gradient);

typedef struct {
    uint16_t x_q4;       /* between pixels, by a parabola through |gx| */
    uint16_t strength;   /* |gx| + |gy|, 1..2040 */
    uint8_t orientation; /* 0..FEATURE_ORIENTATIONS - 1 */
} feature_t;

/* Edges of row y from left to right: where |gx| is a maximum along the row (of equal ones the
 * leftmost) and the strength is at least min_strength (> 0). The border columns have none. Returns
 * how many, at most max; what does not fit is left out. */
uint16_t features_of_row(const image_view_t *view, int y, uint16_t min_strength,
                         feature_t *features, uint16_t max);

typedef struct {
    uint8_t reference_is_right;   /* as in match_params_t */
    uint16_t disparity_max_q4;    /* from 0 on */
    uint8_t max_orientation;      /* sectors that two orientations may differ by, 0..8 */
    uint8_t max_strength_percent; /* of the stronger, that two strengths may differ by, 0..100 */
    uint8_t checks;               /* CHECK_UNIQUENESS, CHECK_ORDERING */
} feature_params_t;

#define FEATURE_NO_PARTNER (-1)

/* For each feature of the reference eye the index of its partner in the other eye, or
 * FEATURE_NO_PARTNER. Partners are most alike: smallest difference of strength plus
 * FEATURE_SECTOR_COST a sector of orientation; ties go to the smaller disparity. With
 * CHECK_UNIQUENESS a partner that two claim goes to the more alike (a tie to the left one); with
 * CHECK_ORDERING the less alike of two that cross loses its partner. Returns how many have one. */
#define FEATURE_SECTOR_COST 64
uint16_t features_match(const feature_t *reference, uint16_t reference_count,
                        const feature_t *other, uint16_t other_count,
                        const feature_params_t *params, int16_t *partner);

#endif
