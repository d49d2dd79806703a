/* What makes a dense disparity map cleaner: the left-right check, a filter for speckles, a median.
 *
 * Each equals a function of OpenCV 4.6 bit for bit. Disparities are 1/16 px, DENSE_INVALID_Q4 where
 * there is none. For the PC; nothing is allocated. Not for interrupts. */
#ifndef VISION_DENSE_FILTER_H
#define VISION_DENSE_FILTER_H

#include <stdint.h>

#include "vision/dense.h"

/* Words of work memory that dense_left_right_row needs. */
#define DENSE_LEFT_RIGHT_WORDS(width) (width)

/* Left-right check of one row of a left eye's map (cv::validateDisparity). Of all pixels from
 * first_x on that meet at the same pixel of the right eye the one with the lowest cost, the
 * leftmost of equal ones, owns it. A pixel loses its disparity if at both whole-pixel places around
 * its partner the owner's disparity differs by more than max_px. costs: one a pixel, below 65535,
 * lower is better. * Disparities must not exceed x. work: `width` words. */
void dense_left_right_row(int16_t *row_q4, const uint16_t *costs, uint16_t width, uint16_t first_x,
                          uint16_t max_px, uint32_t *work);

/* Words of work memory that dense_speckles needs. */
#define DENSE_SPECKLE_WORDS(width, height) ((uint32_t)(width) * (height))

/* Take away small islands (cv::filterSpeckles): neighbours, side by side or one above the other,
 * belong together if their disparities differ by at most max_difference_q4; a piece of at most
 * max_pixels pixels becomes invalid. */
void dense_speckles(int16_t *map_q4, uint16_t width, uint16_t height, uint16_t stride,
                    uint32_t max_pixels, uint16_t max_difference_q4, uint32_t *work);

/* Median of 3x3 pixels (cv::medianBlur), the picture's border repeated; invalid pixels count as
 * what they are, the lowest. in and out must not overlap. */
void dense_median(const int16_t *in_q4, uint16_t width, uint16_t height, uint16_t stride,
                  int16_t *out_q4, uint16_t out_stride);

#endif
