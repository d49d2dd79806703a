/* Dense disparity map as in the paper's simulation (section 4.1): for each pixel of one eye the
 * disparity at which a block around it matches the other eye's picture best.
 *
 * It is correspondence.h at every pixel, with the same rules: a block of size n covers
 * -n/2 .. n-1-n/2 around its anchor, the search is one-sided (the same thing lies further right in
 * the left eye), a place at which the block would leave the other picture is no candidate, of equal
 * costs the smaller disparity wins. A pixel whose own block leaves its picture has no disparity.
 *
 * For the PC and for tests: the robot has neither the memory nor the time. All in integers and
 * exact; nothing is allocated. Not for interrupts. */
#ifndef VISION_DENSE_H
#define VISION_DENSE_H

#include <stdint.h>

#include "vision/correspondence.h"

/* Disparities are 1/16 px; this one says that there is none. As cv::StereoMatcher has it. */
#define DENSE_INVALID_Q4 (-16)

#define DENSE_MAX_SIDE        4096u
#define DENSE_MAX_DISPARITIES 256u
#define DENSE_MAX_PLANES      3u

/* One eye's picture: a plane for grey, three for colour, all with the same stride. */
typedef struct {
    const uint8_t *planes[DENSE_MAX_PLANES];
    uint16_t width;  /* px, 1..DENSE_MAX_SIDE */
    uint16_t height; /* px, 1..DENSE_MAX_SIDE */
    uint16_t stride; /* >= width: pixels from one row of a plane to the next */
} dense_eye_t;

typedef struct {
    match_method_t method;      /* costs of all planes are added up */
    uint8_t planes;             /* 1..DENSE_MAX_PLANES */
    uint8_t hue_first;          /* 1: plane 0 is a hue of 0..179, an angle: SAD and SSD take the
                                 * shorter way round the circle */
    uint8_t block;              /* 1..MATCH_MAX_BLOCK: width and height */
    uint16_t disparities;       /* 1..DENSE_MAX_DISPARITIES: 0 .. disparities - 1 are searched */
    uint8_t reference_is_right; /* 0: the map belongs to the left eye, 1: to the right */
} dense_params_t;

typedef enum {
    DENSE_OK = 0,
    DENSE_BAD_PARAM = -1, /* a parameter or a size is outside its range, or the eyes differ */
    DENSE_TOO_SMALL = -2, /* the picture has no room for a single block */
    DENSE_NO_MEMORY = -3  /* the work memory is smaller than needed */
} dense_error_t;

/* Words of work memory that dense_map needs, 0 if a parameter is out of range: about 4 bytes a
 * pixel of a row and disparity. */
uint32_t dense_work_words(uint16_t width, const dense_params_t *params);

/* Compute the map of the reference eye: width x height disparities in 1/16 px (whole pixels, as in
 * the paper), rows out_stride (>= width) apart. On any error nothing is written. */
dense_error_t dense_map(const dense_eye_t *left, const dense_eye_t *right,
                        const dense_params_t *params, uint32_t *work, uint32_t work_words,
                        int16_t *disparity_q4, uint16_t out_stride);

typedef enum { DENSE_GREY = 0, DENSE_RGB, DENSE_HSV } dense_color_t;

/* Planes that dense_planes fills. */
#define DENSE_COLOR_PLANES(color) ((color) == DENSE_GREY ? 1u : 3u)

/* Split `count` pixels (red, green, blue bytes each) into planes of grey, of red, green, blue, or
 * of hue, saturation, value as in color.h. */
void dense_planes(const uint8_t *rgb, uint32_t count, dense_color_t color,
                  uint8_t *const planes[DENSE_MAX_PLANES]);

#endif
