/* Dense disparity map by block matching with a pre-filter, equal bit for bit to cv::StereoBM of
 * OpenCV 4.6 with its x-Sobel pre-filter (the one that library starts with), minDisparity 0 and no
 * regions of interest. One combination is not: with a cap above 31, OpenCV's left-right check reads
 * costs that its search has written in another width (and beyond their end); ours reads the right
 * ones.
 *
 * In this order: both eyes are replaced by their horizontal gradient, cut to +-cap, which takes
 * away what differs in brightness; each block of the left eye takes the disparity with the smallest
 * sum of absolute differences, of equal ones the larger; blocks without texture and ambiguous ones
 * get none; the place between pixels follows from the neighbouring sums; optionally, disparities
 * that the right eye does not confirm are taken away. dense_filter.h has filters for afterwards.
 *
 * Only the left eye's pixels disparities - 1 + block / 2 <= x < width - block / 2 and
 * block / 2 <= y < height - block / 2 can have a disparity.
 *
 * For the PC and for tests. Integers of 16 bits, in loops that a compiler turns into vector
 * instructions; nothing is allocated. Not for interrupts. */
#ifndef VISION_DENSE_BM_H
#define VISION_DENSE_BM_H

#include <stdint.h>

#include "vision/dense.h"

#define BM_MIN_BLOCK         5u
#define BM_MAX_BLOCK         21u
#define BM_DISPARITY_STEP    16u
#define BM_MAX_PREFILTER_CAP 63u
#define BM_MAX_UNIQUENESS    100u
#define BM_NO_LEFT_RIGHT     (-1)

/* Names in brackets are OpenCV's. */
typedef struct {
    uint8_t block;              /* px, odd, BM_MIN_BLOCK..BM_MAX_BLOCK [blockSize, 21] */
    uint16_t disparities;       /* a multiple of 16, ..DENSE_MAX_DISPARITIES [numDisparities] */
    uint8_t prefilter_cap;      /* 1..63 [preFilterCap, 31] */
    uint8_t uniqueness_percent; /* 0..100: by how much a rival more than 1 px away must be worse; 0:
                                 * no check [uniquenessRatio, 15] */
    uint16_t texture_min;       /* smallest sum of |gradient| in a block; 0: no check
                                 * [textureThreshold, 10] */
    int16_t left_right_max;     /* px: the right eye's disparity may differ by so much; negative: no
                                 * check [disp12MaxDiff, -1] */
} bm_params_t;

/* OpenCV's own parameters, for `block` and `disparities`. */
bm_params_t bm_defaults(uint8_t block, uint16_t disparities);

/* Words of work memory that bm_map needs, 0 if a parameter or the size is out of range. */
uint32_t bm_work_words(uint16_t width, uint16_t height, const bm_params_t *params);

/* Compute the left eye's map: width x height disparities in 1/16 px, rows out_stride (>= width)
 * apart. Takes the first plane of each eye as grey. DENSE_TOO_SMALL if the picture is not larger
 * than a block in both directions. On any error nothing is written. */
dense_error_t bm_map(const dense_eye_t *left, const dense_eye_t *right, const bm_params_t *params,
                     uint32_t *work, uint32_t work_words, int16_t *disparity_q4,
                     uint16_t out_stride);

#endif
