#include "vision/features.h"

#define NO_COST UINT32_MAX

static int32_t magnitude(int32_t value)
{
    return value < 0 ? -value : value;
}

/* Mirrored at the border, without repeating the edge pixel. */
static int mirrored(int at, int size)
{
    if (at < 0)
        return -at;
    return at >= size ? 2 * size - 2 - at : at;
}

gradient_t sobel_at(const image_view_t *view, int x, int y)
{
    const uint8_t *above = view->pixels + (int32_t)mirrored(y - 1, view->height) * view->stride;
    const uint8_t *here = view->pixels + (int32_t)y * view->stride;
    const uint8_t *below = view->pixels + (int32_t)mirrored(y + 1, view->height) * view->stride;
    int l = mirrored(x - 1, view->width);
    int r = mirrored(x + 1, view->width);
    gradient_t gradient;

    gradient.gx = (int16_t)(above[r] + 2 * here[r] + below[r] - above[l] - 2 * here[l] - below[l]);
    gradient.gy =
        (int16_t)(below[l] + 2 * below[x] + below[r] - above[l] - 2 * above[x] - above[r]);
    return gradient;
}

uint8_t gradient_orientation(gradient_t gradient)
{
    /* tan 11.25 and tan 33.75 degrees, in 1/256. */
    const int32_t tan_first = 51;
    const int32_t tan_second = 171;
    int32_t along = magnitude(gradient.gx);
    int32_t across = magnitude(gradient.gy);
    uint8_t sector; /* from the x axis, 0..4 */

    if (256 * across <= tan_first * along)
        sector = 0;
    else if (256 * across <= tan_second * along)
        sector = 1;
    else if (tan_second * across < 256 * along)
        sector = 2;
    else if (tan_first * across < 256 * along)
        sector = 3;
    else
        sector = 4;
    if (gradient.gx < 0)
        sector = (uint8_t)(8 - sector);
    if (gradient.gy < 0)
        sector = (uint8_t)(FEATURE_ORIENTATIONS - sector);
    return sector % FEATURE_ORIENTATIONS;
}

/* Where the parabola through three values at x - 1, x, x + 1 has its maximum, 1/16 px. */
static uint16_t peak_q4(int x, int32_t before, int32_t here, int32_t after)
{
    int32_t curvature = 2 * (2 * here - before - after);
    int32_t shift = curvature > 0 ? 16 * (after - before) / curvature : 0;

    return (uint16_t)(16 * x + shift);
}

uint16_t features_of_row(const image_view_t *view, int y, uint16_t min_strength,
                         feature_t *features, uint16_t max)
{
    uint16_t count = 0;
    int32_t before;
    gradient_t here;
    int x;

    if (view->width < 3 || y < 0 || y >= view->height)
        return 0;
    before = magnitude(sobel_at(view, 0, y).gx);
    here = sobel_at(view, 1, y);
    for (x = 1; x + 1 < view->width && count < max; x++) {
        gradient_t next = sobel_at(view, x + 1, y);
        int32_t strength = magnitude(here.gx) + magnitude(here.gy);

        if (here.gx && strength >= min_strength && magnitude(here.gx) > before &&
            magnitude(here.gx) >= magnitude(next.gx)) {
            features[count].x_q4 = peak_q4(x, before, magnitude(here.gx), magnitude(next.gx));
            features[count].strength = (uint16_t)strength;
            features[count].orientation = gradient_orientation(here);
            count++;
        }
        before = magnitude(here.gx);
        here = next;
    }
    return count;
}

/* How unlike two features are, or NO_COST if they cannot be the same thing. */
static uint32_t unlikeness(const feature_t *reference, const feature_t *other,
                           const feature_params_t *params)
{
    int32_t d_q4 = (int32_t)other->x_q4 - reference->x_q4;
    int32_t difference = magnitude((int32_t)reference->strength - other->strength);
    int32_t stronger =
        reference->strength > other->strength ? reference->strength : other->strength;
    int32_t turn = magnitude((int32_t)reference->orientation - other->orientation);

    if (!params->reference_is_right)
        d_q4 = -d_q4;
    if (turn > (int32_t)FEATURE_ORIENTATIONS / 2)
        turn = (int32_t)FEATURE_ORIENTATIONS - turn;
    if (d_q4 < 0 || d_q4 > params->disparity_max_q4 || turn > params->max_orientation ||
        100 * difference > params->max_strength_percent * stronger)
        return NO_COST;
    return (uint32_t)(difference + FEATURE_SECTOR_COST * turn);
}

/* Cost of reference feature i with the partner it has. */
static uint32_t cost_of(const feature_t *reference, const feature_t *other,
                        const feature_params_t *params, const int16_t *partner, uint16_t i)
{
    return unlikeness(&reference[i], &other[partner[i]], params);
}

static int16_t most_alike(const feature_t *feature, const feature_t *other, uint16_t other_count,
                          const feature_params_t *params)
{
    uint32_t best = NO_COST;
    int16_t found = FEATURE_NO_PARTNER;
    uint16_t j;

    for (j = 0; j < other_count; j++) {
        /* The right eye's partners lie to the right, nearest first; the left eye's to the left. */
        uint16_t at = params->reference_is_right ? j : (uint16_t)(other_count - 1 - j);
        uint32_t cost = unlikeness(feature, &other[at], params);

        if (cost < best) {
            best = cost;
            found = (int16_t)at;
        }
    }
    return found;
}

/* Whether the partners of two reference features, i left of j, break a rule that is switched on. */
static int conflict(const feature_params_t *params, int16_t partner_i, int16_t partner_j)
{
    if ((params->checks & CHECK_UNIQUENESS) && partner_i == partner_j)
        return 1;
    return (params->checks & CHECK_ORDERING) && partner_i > partner_j;
}

uint16_t features_match(const feature_t *reference, uint16_t reference_count,
                        const feature_t *other, uint16_t other_count,
                        const feature_params_t *params, int16_t *partner)
{
    uint16_t count = 0;
    uint16_t i;
    uint16_t j;

    for (i = 0; i < reference_count; i++)
        partner[i] = most_alike(&reference[i], other, other_count, params);
    for (j = 1; j < reference_count; j++) {
        for (i = 0; i < j && partner[j] != FEATURE_NO_PARTNER; i++) {
            if (partner[i] == FEATURE_NO_PARTNER || !conflict(params, partner[i], partner[j]))
                continue;
            if (cost_of(reference, other, params, partner, j) <
                cost_of(reference, other, params, partner, i))
                partner[i] = FEATURE_NO_PARTNER;
            else
                partner[j] = FEATURE_NO_PARTNER;
        }
    }
    for (i = 0; i < reference_count; i++)
        count = (uint16_t)(count + (partner[i] != FEATURE_NO_PARTNER));
    return count;
}
