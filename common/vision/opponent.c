#include "vision/opponent.h"

#include "vision/camera.h"

/* The widest stripe that is taken for one: 14 mm, 70 mm before the lens. What is too wide for the
 * disparity found is left out later. */
#define MAX_STRIPE_Q4 (64 * 16)
/* Edges in both eyes count as one if they differ by this after the shift. */
#define EDGE_REACH_Q4 28
#define MAX_COST      INT32_MAX
/* The largest search range that FPGA_REG_SEARCH_MAX takes. */
#define MAX_SEARCH_PX 127

typedef struct {
    int first; /* indices of edges in the right eye */
    int last;
} group_t;

typedef struct {
    group_t group;
    int disparity; /* px */
    int32_t cost;  /* mean difference of profiles along the strip, 0..2040 */
    int32_t second_cost;
} strip_match_t;

static int magnitude(int value)
{
    return value < 0 ? -value : value;
}

/* Whether the stripe between two edges is plausible: they are opposite, one side is much darker,
 * and what lies between has no colour. */
static int is_stripe(const band_t *band, int eye, const band_edge_t *a, const band_edge_t *b,
                     const eye_params_t *params)
{
    int bright = band_edge_rises(a);
    int level = bright ? a->after : a->before;
    int dark = bright ? a->before : a->after;
    int x;

    if (band_edge_rises(b) == bright || b->x_q4 - a->x_q4 > MAX_STRIPE_Q4)
        return 0;
    if (256 * dark > params->stripe_black * level)
        return 0;
    x = (a->x_q4 + b->x_q4 + 16) / 32;
    /* The ball's yellowness is 1.6 to 2 times its grey, that of white in warm light 0.6 times. */
    return !bright || band->yellowness[eye][x] < level;
}

static int stripe_width_q4(const band_edges_t *found, int i)
{
    return found->edges[i + 1].x_q4 - found->edges[i].x_q4;
}

/* Whether stripe `end`, of whose neighbours inwards the next is `inner` and then `inmost`, is none:
 * the goal's black, or wall, between the body and the goal's edge. The stripes of a round body get
 * narrower towards its ends, so none there is twice as wide as one that is narrower than the next.
 */
static int is_odd_end(const band_edges_t *found, int end, int inner, int inmost)
{
    return stripe_width_q4(found, end) > 2 * stripe_width_q4(found, inner) &&
           stripe_width_q4(found, inner) <= stripe_width_q4(found, inmost);
}

/* Leave out what is no stripe at either end. */
static void trim_odd_ends(const band_edges_t *found, group_t *group)
{
    int stripes = group->last - group->first;

    if (stripes >= 3 && is_odd_end(found, group->first, group->first + 1, group->first + 2)) {
        group->first++;
        stripes--;
    }
    if (stripes >= 3 && is_odd_end(found, group->last - 1, group->last - 2, group->last - 3))
        group->last--;
}

/* The next run of stripes from edge *from on. One edge less than a strip has tells that a body is
 * there, though too little of it, or too near, to be matched. */
static int next_group(const band_t *band, const eye_params_t *params, int *from, group_t *group)
{
    const band_edges_t *found = &band->edges[EYE_RIGHT];
    int i = *from;

    while (i + 1 < found->count) {
        group->first = i;
        while (i + 1 < found->count &&
               is_stripe(band, EYE_RIGHT, &found->edges[i], &found->edges[i + 1], params))
            i++;
        group->last = i;
        if (group->last - group->first + 1 >= params->stripe_edges - 1) {
            *from = i + 1;
            trim_odd_ends(found, group);
            return 1;
        }
        if (group->last == group->first)
            i++;
    }
    return 0;
}

/* Mean difference of the profiles over columns a..b of the right eye at disparity d. */
static int32_t strip_cost(const band_t *band, int a, int b, int d)
{
    int32_t sum = 0;
    int x;

    for (x = a; x <= b; x++)
        sum += magnitude(band->profile[EYE_RIGHT][x] - band->profile[EYE_LEFT][x + d]);
    return sum / (b - a + 1);
}

/* Leave out stripes at the ends that are too wide for the disparity: the goal's edge beside the
 * body, say. */
static void trim_group(const band_edges_t *found, int stripe_max_mm, int disparity, group_t *group)
{
    int widest_q4 = 16 * disparity * stripe_max_mm * 10 / (CAMERA_BASELINE_UM / 100) + 24;
    int middle = (group->first + group->last) / 2;
    int i;

    for (i = middle; i > group->first; i--)
        if (found->edges[i].x_q4 - found->edges[i - 1].x_q4 > widest_q4)
            group->first = i;
    for (i = middle; i < group->last; i++)
        if (found->edges[i + 1].x_q4 - found->edges[i].x_q4 > widest_q4)
            group->last = i;
}

/* Whether a strip of this width may be a body at this disparity: the whole body is 60/50.4 of its
 * axis' disparity wide; stripes at its ends may be lost before something dark, or by the border. */
static int is_body_width(int width_q4, int disparity)
{
    return 10 * width_q4 >= 6 * 16 * disparity && 10 * width_q4 <= 14 * 16 * disparity + 240;
}

/* The group as it would be at this disparity, and its cost; 0 if it cannot be a body there. */
static int match_at(const band_t *band, const eye_params_t *params, int disparity, group_t *group,
                    int32_t *cost)
{
    const band_edges_t *found = &band->edges[EYE_RIGHT];
    int a;
    int b;

    trim_group(found, params->stripe_max, disparity, group);
    if (group->last - group->first + 1 < params->stripe_edges ||
        !is_body_width(found->edges[group->last].x_q4 - found->edges[group->first].x_q4, disparity))
        return 0;
    a = found->edges[group->first].x_q4 / 16 - 1;
    b = found->edges[group->last].x_q4 / 16 + 2;
    if (a < 0)
        a = 0;
    if (b >= CAMERA_WIDTH_PX)
        b = CAMERA_WIDTH_PX - 1;
    /* The left eye may see only a part of the body: half of it is enough. */
    if (a + b + 2 * disparity > 2 * (CAMERA_WIDTH_PX - 1))
        return 0;
    if (b + disparity >= CAMERA_WIDTH_PX)
        b = CAMERA_WIDTH_PX - 1 - disparity;
    *cost = strip_cost(band, a, b, disparity);
    return 1;
}

static int match_group(const band_t *band, const eye_params_t *params, const group_t *whole,
                       strip_match_t *match)
{
    int32_t costs[MAX_SEARCH_PX + 1];
    int d;

    match->disparity = 0;
    match->cost = match->second_cost = MAX_COST;
    for (d = 2; d <= params->search_max; d++) {
        group_t group = *whole;

        costs[d] = MAX_COST;
        if (match_at(band, params, d, &group, &costs[d]) && costs[d] < match->cost) {
            match->cost = costs[d];
            match->disparity = d;
            match->group = group;
        }
    }
    for (d = 2; d <= params->search_max; d++)
        if (magnitude(d - match->disparity) > 2 && costs[d] < match->second_cost)
            match->second_cost = costs[d];
    return match->cost != MAX_COST;
}

/* Disparity of the nearest surface from the stripe edges around the strip's middle, or that of the
 * whole strip if none of them is found in both eyes. */
static int surface_disparity_q4(const band_t *band, const strip_match_t *match, int middle_q4)
{
    const band_edges_t *found = &band->edges[EYE_RIGHT];
    /* Half the body's radius: 15 mm. */
    int reach_q4 = 16 * match->disparity * 150 / (int)(CAMERA_BASELINE_UM / 100) + 8;
    int32_t sum = 0;
    int used = 0;
    int i;

    for (i = match->group.first; i <= match->group.last; i++) {
        const band_edge_t *right = &found->edges[i];
        int32_t aside_q4 = right->x_q4 - middle_q4;
        const band_edge_t *left;

        if (magnitude((int)aside_q4) > reach_q4)
            continue;
        left = band_nearest_edge(band, EYE_LEFT, (int16_t)(right->x_q4 + 16 * match->disparity),
                                 band_edge_rises(right), EDGE_REACH_Q4);
        if (!left)
            continue;
        /* A point `aside` of the axis lies r u^2/2 deeper (u = aside / r), which costs
         * d^2 / (f T) times that in disparity: aside^2 / 389 px for r = 30 mm, at any d. */
        sum += left->x_q4 - right->x_q4 + aside_q4 * aside_q4 / (389 * 16);
        used++;
    }
    return used ? (int)((sum + used / 2) / used) : 16 * match->disparity;
}

/* 0..15: how much worse the second-best place of the strip is, against half its contrast if there
 * is no second. */
static uint8_t confidence(const strip_match_t *match, int contrast)
{
    int32_t second = match->second_cost == MAX_COST ? contrast / 2 : match->second_cost;

    if (second <= match->cost)
        return 1;
    return (uint8_t)(1 + 14 * (second - match->cost) / second);
}

/* What the strip covers: a white end before the wall, or a black one before the goal, is no edge of
 * the strip, and a stripe at the end is up to a sixth of the body wide. */
static void set_extent(opponent_extent_t *extent, int first_q4, int last_q4)
{
    int margin_q4 = (last_q4 - first_q4) / 6 + 48;

    extent->seen = 1;
    extent->first_q4 = (int16_t)(first_q4 - margin_q4);
    extent->last_q4 = (int16_t)(last_q4 + margin_q4);
}

static void fill(const band_t *band, const strip_match_t *match, report_t *report,
                 opponent_extent_t *extent)
{
    const band_edges_t *found = &band->edges[EYE_RIGHT];
    int first_q4 = found->edges[match->group.first].x_q4;
    int last_q4 = found->edges[match->group.last].x_q4;
    const band_edge_t *edge = &found->edges[match->group.first + 1];

    set_extent(extent, first_q4, last_q4);
    report->flags |= REPORT_OPPONENT;
    report->opponent_x_q4 = (uint16_t)((first_q4 + last_q4) / 2);
    report->opponent_disparity_q4 =
        (uint16_t)surface_disparity_q4(band, match, (first_q4 + last_q4) / 2);
    report->opponent_confidence = confidence(match, magnitude(edge->after - edge->before));
}

void opponent_find(const band_t *band, const eye_params_t *params, report_t *report,
                   opponent_extent_t *extent)
{
    strip_match_t best;
    int best_width_q4 = 0;
    group_t group;
    int from = 0;

    extent->seen = 0;
    extent->first_q4 = extent->last_q4 = 0;
    while (next_group(band, params, &from, &group)) {
        const band_edges_t *found = &band->edges[EYE_RIGHT];
        strip_match_t match;
        int width_q4 = found->edges[group.last].x_q4 - found->edges[group.first].x_q4;
        const band_edge_t *inner = &found->edges[group.first + 1];

        if (!extent->seen) {
            set_extent(extent, found->edges[group.first].x_q4, found->edges[group.last].x_q4);
        }
        if (!match_group(band, params, &group, &match))
            continue;
        /* Two stripes of the dress never differ from their image by half their contrast. */
        if (2 * match.cost > magnitude(inner->after - inner->before) || width_q4 <= best_width_q4)
            continue;
        best = match;
        best_width_q4 = width_q4;
    }
    if (best_width_q4)
        fill(band, &best, report, extent);
}
