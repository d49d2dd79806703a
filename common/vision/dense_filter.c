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
