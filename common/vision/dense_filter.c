#include "vision/dense_filter.h"

#include "vision/multiversion.h"

/* An owner of a right eye's pixel in one word, so that the lower one is the better: the cost above,
 * the disparity below. Costs are below 65535. */
#define NOBODY UINT32_MAX

static uint32_t owner_of(uint16_t cost, int16_t disparity)
{
    return (uint32_t)cost << 16 | (uint16_t)disparity;
}

/* The owner of right pixel x contradicts the disparity. Nobody, or a place outside, does not. */
static int contradicts(const uint32_t *owners, int32_t x, uint16_t width, int16_t disparity,
                       int32_t max_q4)
{
    int32_t difference;

    if (x < 0 || x >= width || owners[x] == NOBODY)
        return 0;
    difference = (int32_t)(owners[x] & UINT16_MAX) - disparity;
    return difference > max_q4 || -difference > max_q4;
}

void dense_left_right_row(int16_t *row_q4, const uint16_t *costs, uint16_t width, uint16_t first_x,
                          uint16_t max_px, uint32_t *work)
{
    int32_t x;

    for (x = 0; x < width; x++)
        work[x] = NOBODY;
    for (x = first_x; x < width; x++) {
        uint32_t owner = owner_of(costs[x], row_q4[x]);
        uint32_t *place;

        if (row_q4[x] < 0)
            continue;
        place = work + x - (row_q4[x] + 8) / 16;
        if (*place >> 16 > costs[x])
            *place = owner;
    }
    for (x = first_x; x < width; x++) {
        int16_t disparity = row_q4[x];

        if (disparity >= 0 &&
            contradicts(work, x - disparity / 16, width, disparity, 16 * (int32_t)max_px) &&
            contradicts(work, x - (disparity + 15) / 16, width, disparity, 16 * (int32_t)max_px))
            row_q4[x] = DENSE_INVALID_Q4;
    }
}

/* Pieces as a forest in one word a pixel: a root has IS_ROOT and the number of its pixels, any
 * other pixel the index of one nearer to its root. */
#define IS_ROOT 0x80000000u

static uint32_t root_of(uint32_t *forest, uint32_t i)
{
    while (!(forest[i] & IS_ROOT)) {
        uint32_t above = forest[i];

        if (!(forest[above] & IS_ROOT))
            forest[i] = forest[above]; /* halves the way for the next who comes by */
        i = above;
    }
    return i;
}

static void join(uint32_t *forest, uint32_t a, uint32_t b)
{
    uint32_t large = root_of(forest, a);
    uint32_t small = root_of(forest, b);

    if (large == small)
        return;
    if (forest[large] < forest[small]) {
        uint32_t swap = large;

        large = small;
        small = swap;
    }
    forest[large] += forest[small] & ~IS_ROOT;
    forest[small] = large;
}

static int belong_together(int16_t a, int16_t b, uint16_t max_difference)
{
    int32_t difference = (int32_t)a - b;

    return a != DENSE_INVALID_Q4 && b != DENSE_INVALID_Q4 && difference <= max_difference &&
           -difference <= max_difference;
}

void dense_speckles(int16_t *map_q4, uint16_t width, uint16_t height, uint16_t stride,
                    uint32_t max_pixels, uint16_t max_difference_q4, uint32_t *work)
{
    uint32_t x;
    uint32_t y;

    for (y = 0; y < height; y++) {
        const int16_t *row = map_q4 + y * stride;

        for (x = 0; x < width; x++) {
            uint32_t i = y * width + x;

            work[i] = IS_ROOT | 1u;
            if (x > 0 && belong_together(row[x], row[x - 1], max_difference_q4))
                join(work, i - 1, i);
            if (y > 0 && belong_together(row[x], *(row + x - stride), max_difference_q4))
                join(work, i - width, i);
        }
    }
    for (y = 0; y < height; y++)
        for (x = 0; x < width; x++)
            if ((work[root_of(work, y * width + x)] & ~IS_ROOT) <= max_pixels)
                map_q4[y * stride + x] = DENSE_INVALID_Q4;
}

static inline int16_t lower(int16_t a, int16_t b)
{
    return a < b ? a : b;
}

static inline int16_t higher(int16_t a, int16_t b)
{
    return a > b ? a : b;
}

static inline int16_t middle(int16_t a, int16_t b, int16_t c)
{
    return higher(lower(a, b), lower(higher(a, b), c));
}

/* Median at x of three rows with the columns before and after. With each column in order, it is the
 * middle of the highest low, the middle of the middles, and the lowest high. */
static inline int16_t median_at(const int16_t *a, const int16_t *b, const int16_t *c,
                                uint32_t before, uint32_t x, uint32_t after)
{
    int16_t low = higher(
        higher(lower(lower(a[before], b[before]), c[before]), lower(lower(a[x], b[x]), c[x])),
        lower(lower(a[after], b[after]), c[after]));
    int16_t mid = middle(middle(a[before], b[before], c[before]), middle(a[x], b[x], c[x]),
                         middle(a[after], b[after], c[after]));
    int16_t high = lower(
        lower(higher(higher(a[before], b[before]), c[before]), higher(higher(a[x], b[x]), c[x])),
        higher(higher(a[after], b[after]), c[after]));

    return middle(low, mid, high);
}

MULTIVERSION
static void median_row(const int16_t *above, const int16_t *row, const int16_t *below,
                       uint32_t width, int16_t *restrict out)
{
    uint32_t last = width - 1;
    uint32_t x;

    out[0] = median_at(above, row, below, 0, 0, last ? 1 : 0);
    for (x = 1; x < last; x++)
        out[x] = median_at(above, row, below, x - 1, x, x + 1);
    if (last)
        out[last] = median_at(above, row, below, last - 1, last, last);
}

void dense_median(const int16_t *in_q4, uint16_t width, uint16_t height, uint16_t stride,
                  int16_t *out_q4, uint16_t out_stride)
{
    uint32_t y;

    for (y = 0; width > 0 && y < height; y++) {
        const int16_t *row = in_q4 + y * stride;

        median_row(y > 0 ? row - stride : row, row, y + 1u < height ? row + stride : row, width,
                   out_q4 + y * out_stride);
    }
}
