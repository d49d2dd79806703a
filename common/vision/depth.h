/* Depth: from pixels and disparity to millimetres on the pitch.
 *
 * Z = f T / d (paper, section 2.2), then turned by the camera's tilt into the robot's frame:
 * forward and left of the point on the floor below the middle between the lenses, and height above
 * the floor. 32-bit integers and 32-bit divisions only: about three divisions a point, cheap on a
 * 68331. Pure functions; may be called from an interrupt. */
#ifndef VISION_DEPTH_H
#define VISION_DEPTH_H

#include <stdint.h>

/* The smallest disparity that still means a place: 1 px, 16.5 m away. */
#define DEPTH_MIN_DISPARITY_Q4 16u
/* What a depth beyond that is reported as. */
#define DEPTH_FAR_MM           0xFFFFu

typedef struct {
    int16_t forward_mm; /* ahead of the lenses */
    int16_t left_mm;    /* of the robot's middle; negative = right */
    int16_t height_mm;  /* above the floor */
} ground_point_t;

/* Distance Z along the optical axis, mm, rounded; DEPTH_FAR_MM below DEPTH_MIN_DISPARITY_Q4. */
uint16_t depth_mm(uint16_t disparity_q4);

/* How much farther Z gets, mm (rounded up), when the disparity is one step of 1/16 px smaller: the
 * error that one sub-pixel step means. DEPTH_FAR_MM below DEPTH_MIN_DISPARITY_Q4 + 1. */
uint16_t depth_step_mm(uint16_t disparity_q4);

/* Where the point is that the right eye sees at (x, y) with this disparity. Coordinates in 1/16 px,
 * any value within the image. Returns 1, or 0 with *point untouched if the disparity is below
 * DEPTH_MIN_DISPARITY_Q4. */
int depth_ground_point(uint16_t x_q4, uint16_t y_q4, uint16_t disparity_q4, ground_point_t *point);

/* Where the point is that the RIGHT eye sees at (x, y) if it is known to be `height_mm` (0..90)
 * above the floor: for what only one eye sees, and for the foot of the wall (height 0). For
 * a LEFT-eye pixel add 50 mm to left_mm. Returns 1, or 0 with *point untouched if the ray does not
 * come down to that height within 16 m. */
int depth_on_plane(uint16_t x_q4, uint16_t y_q4, int16_t height_mm, ground_point_t *point);

#endif
