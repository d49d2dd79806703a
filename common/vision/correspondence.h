/* Correspondence at a point: which place of one eye's image matches a block of the other's.
 *
 * The paper's area-based matching (section 2.3): a block around the anchor is compared with the
 * blocks along the epipolar line in the other eye, by the sum of absolute differences (SAD), of
 * squared differences (SSD), by cross correlation as the paper writes it (CORR), or by cross
 * correlation divided by the energy of both blocks (NCC). The paper's constraints are checks that
 * can be switched on one by one.
 *
 * A block of size n covers -n/2 .. n-1-n/2 around its anchor: 8 covers -4..+3, an odd size is
 * centred. The search is one-sided: the same thing lies further right in the left image.
 *
 * Rules: a place at which the block would leave the other image is no candidate. Of equal costs
 * the smaller disparity wins, then the smaller row offset, then the one above. All functions are
 * pure. The robot's own use (SAD 8x8 on 12 rows) needs 32-bit arithmetic only.
 *
 * What the hardware would hold: both bands of rows, and one accumulator a candidate in flight. */
#ifndef VISION_CORRESPONDENCE_H
#define VISION_CORRESPONDENCE_H

#include <stdint.h>

/* A grey image. stride >= width: pixels from one row to the next. */
typedef struct {
    const uint8_t *pixels;
    uint16_t width;
    uint16_t height;
    uint16_t stride;
} image_view_t;

typedef enum { MATCH_SAD = 0, MATCH_SSD, MATCH_CORR, MATCH_NCC } match_method_t;

#define MATCH_MAX_BLOCK     32u
#define MATCH_MAX_DISPARITY 255u
/* NCC's cost is the correlation coefficient in this unit; equal blocks have exactly this. */
#define MATCH_NCC_ONE       (1ul << 20)

/* Checks, bits of match_params_t.checks and of match_t.failed. */
#define CHECK_UNIQUENESS 0x01u /* the second-best cost, > 1 px away, is clearly worse */
#define CHECK_SIMILARITY 0x02u /* the blocks resemble each other at all */
#define CHECK_TEXTURE    0x04u /* the block has something to match */
#define CHECK_LEFT_RIGHT 0x08u /* matching back from the found place leads home */
#define CHECK_ORDERING   0x10u /* only set by match_check_ordering */
#define CHECK_CONTINUITY 0x20u /* only set by match_check_continuity */

typedef struct {
    match_method_t method;
    uint8_t block_width; /* 1..MATCH_MAX_BLOCK */
    uint8_t block_height;
    uint8_t reference_is_right; /* 1: anchor in the right image, searched at x + d in the left;
                                 * 0: anchor in the left image, searched at x - d in the right */
    uint8_t disparity_min;      /* 0..disparity_max */
    uint8_t disparity_max;      /* ..MATCH_MAX_DISPARITY */
    uint8_t rows;               /* rows y - rows .. y + rows are searched; 0 for rectified images */
    uint8_t checks;             /* CHECK_UNIQUENESS .. CHECK_LEFT_RIGHT */
    uint8_t uniqueness_percent; /* 1..99: by how much second best must be worse */
    uint8_t left_right_max;     /* px: largest difference there and back */
    uint32_t similarity_limit; /* SAD, SSD: largest cost; CORR, NCC: smallest; of the whole block */
    uint32_t texture_min;      /* smallest sum of |horizontal differences| in the reference block */
} match_params_t;

typedef struct {
    uint16_t disparity_q4; /* sub-pixel: see match_subpixel_q4 */
    uint8_t disparity;     /* whole pixels */
    int8_t row_offset;     /* row in the other image - y */
    uint8_t failed;        /* checks that were asked for and failed */
    uint32_t cost;         /* the best: lowest for SAD and SSD, highest for CORR and NCC */
    uint32_t second_cost;  /* the best of those more than 1 px away; = worst possible if none */
    uint32_t texture;
} match_t;

typedef enum {
    MATCH_OK = 0,        /* see match_t.failed for the checks */
    MATCH_BORDER = -1,   /* the reference block or every candidate leaves the image */
    MATCH_BAD_PARAM = -2 /* a parameter is outside its range, or the images differ in size */
} match_error_t;

/* Cost of comparing the block of `a` anchored at (ax, ay) with that of `b` at (bx, by). Both blocks
 * must lie inside. SAD <= 261,120; SSD, CORR <= 66,585,600; NCC <= MATCH_NCC_ONE. A block of zeros
 * has NCC 0. NCC takes a 64-bit division. */
uint32_t match_cost(match_method_t method, const image_view_t *a, int ax, int ay,
                    const image_view_t *b, int bx, int by, int block_width, int block_height);

/* Find the match of the block anchored at (x, y) of the reference eye. On MATCH_OK *match is
 * filled, otherwise untouched. */
match_error_t match_find(const image_view_t *left, const image_view_t *right, int x, int y,
                         const match_params_t *params, match_t *match);

/* Offset of the true extreme, -8..8 sixteenths of a pixel, from the costs at d - 1, d, d + 1, d
 * being the best. A parabola for SSD, CORR and NCC; for SAD, which falls and rises linearly, two
 * lines of equal steepness (as cv::StereoBM does). */
int match_subpixel_q4(match_method_t method, uint32_t before, uint32_t best, uint32_t after);

/* Ordering constraint on matches of one row, from left to right in the reference eye: `x_other`
 * must grow. The worse of two that cross gets CHECK_ORDERING; matches that have failed already are
 * passed over. count <= 320. Lower cost is better for SAD and SSD, higher for CORR and NCC. */
void match_check_ordering(match_method_t method, match_t *matches, const int16_t *x_other,
                          uint16_t count);

/* Continuity constraint: a match gets CHECK_CONTINUITY if it differs by more than limit_q4 from
 * both its neighbours in the row (from the only one, at the ends) that have not failed. */
void match_check_continuity(match_t *matches, uint16_t count, uint16_t limit_q4);

#endif
