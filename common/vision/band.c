#include "vision/band.h"

#include "vision/color.h"

/* An edge's steepness, over two pixels: a share of the profile's whole range, and at least
 * edge_min, by default four standard deviations of a bad camera's noise (6 grey levels a pixel, 24
 * in such a difference of sums). */
#define EDGE_RANGE_SHARE 8
/* How far from the steepest place the levels on both sides are looked for. */
#define LEVEL_REACH_PX   4

static void load_eye(band_t *band, const frame_pair_t *frames, int eye, int row)
{
    int i;
    int x;

    for (x = 0; x < CAMERA_WIDTH_PX; x++)
        band->profile[eye][x] = band->yellowness[eye][x] = 0;
    for (i = 0; i < BAND_ROWS; i++) {
        const uint16_t *pixels = frame_row(frames, eye, row - BAND_ROWS_ABOVE + i);
        int in_block = i >= BAND_LINE - BLOCK_SIZE / 2 && i < BAND_LINE + BLOCK_SIZE / 2;

        for (x = 0; x < CAMERA_WIDTH_PX; x++)
            band->grey[eye][i][x] = color_grey565(pixels[x]);
        if (!in_block)
            continue;
        for (x = 0; x < CAMERA_WIDTH_PX; x++) {
            band->profile[eye][x] = (int16_t)(band->profile[eye][x] + band->grey[eye][i][x]);
            band->yellowness[eye][x] =
                (int16_t)(band->yellowness[eye][x] + color_yellowness(pixels[x]));
        }
    }
}

static int steepness_needed(const int16_t *profile, const eye_params_t *params)
{
    int least = BLOCK_SIZE * params->edge_min;
    int16_t lowest = profile[0];
    int16_t highest = profile[0];
    int needed;
    int x;

    for (x = 1; x < CAMERA_WIDTH_PX; x++) {
        if (profile[x] < lowest)
            lowest = profile[x];
        if (profile[x] > highest)
            highest = profile[x];
    }
    needed = (highest - lowest) / EDGE_RANGE_SHARE;
    return needed < least ? least : needed;
}

/* The highest (sign 1) or lowest (sign -1) level among x and the pixels beyond it, going by step.
 */
static int16_t extreme_level(const int16_t *profile, int x, int step, int sign)
{
    int16_t best = profile[x];
    int i;

    for (i = 0; i < LEVEL_REACH_PX; i++) {
        x += step;
        if (x < 0 || x >= CAMERA_WIDTH_PX)
            break;
        if (sign * profile[x] > sign * best)
            best = profile[x];
    }
    return best;
}

/* Place the edge that is steepest between columns x - 1 and x + 1. */
static band_edge_t place_edge(const int16_t *profile, int x, int sign)
{
    band_edge_t edge;
    int32_t middle;
    int32_t step;

    edge.before = extreme_level(profile, x, -1, -sign);
    edge.after = extreme_level(profile, x, 1, sign);
    middle = edge.before + edge.after; /* twice the middle level */
    while (x > 0 && sign * (2L * profile[x] - middle) > 0)
        x--;
    while (x + 2 < CAMERA_WIDTH_PX && sign * (2L * profile[x + 1] - middle) < 0)
        x++;
    step = 2L * (profile[x + 1] - profile[x]);
    edge.x_q4 = (int16_t)(16 * x + (step ? 16 * (middle - 2L * profile[x]) / step : 8));
    return edge;
}

static int slope(const int16_t *profile, int x)
{
    return profile[x + 1] - profile[x - 1];
}

static int magnitude(int value)
{
    return value < 0 ? -value : value;
}

/* An edge is where the profile is steepest, and steep enough; two of the same direction this close
 * are one that noise has split. */
#define EDGE_SPLIT_Q4 (3 * 16)

static void find_edges(const int16_t *profile, const eye_params_t *params, band_edges_t *found)
{
    int needed = steepness_needed(profile, params);
    int split_steepness = 0;
    int x;

    found->count = 0;
    for (x = 2; x < CAMERA_WIDTH_PX - 2; x++) {
        int here = slope(profile, x);
        int steepness = magnitude(here);
        band_edge_t edge;
        band_edge_t *last = found->count ? &found->edges[found->count - 1] : 0;

        if (steepness < needed || steepness <= magnitude(slope(profile, x - 1)) ||
            steepness < magnitude(slope(profile, x + 1)))
            continue;
        edge = place_edge(profile, x, here > 0 ? 1 : -1);
        if (last && band_edge_rises(last) == band_edge_rises(&edge) &&
            edge.x_q4 - last->x_q4 < EDGE_SPLIT_Q4) {
            if (steepness <= split_steepness)
                continue;
            found->count--;
        }
        split_steepness = steepness;
        if (found->count < BAND_MAX_EDGES)
            found->edges[found->count++] = edge;
    }
}

void band_load(band_t *band, const frame_pair_t *frames, uint8_t row, const eye_params_t *params)
{
    int eye;

    for (eye = 0; eye < EYE_COUNT; eye++) {
        load_eye(band, frames, eye, row);
        find_edges(band->profile[eye], params, &band->edges[eye]);
    }
}

const band_edge_t *band_nearest_edge(const band_t *band, int eye, int16_t x_q4, int rising,
                                     int16_t reach_q4)
{
    const band_edges_t *found = &band->edges[eye];
    const band_edge_t *nearest = 0;
    int best = reach_q4 + 1;
    int i;

    for (i = 0; i < found->count; i++) {
        const band_edge_t *edge = &found->edges[i];
        int distance = edge->x_q4 > x_q4 ? edge->x_q4 - x_q4 : x_q4 - edge->x_q4;

        if (band_edge_rises(edge) == rising && distance < best) {
            best = distance;
            nearest = edge;
        }
    }
    return nearest;
}
