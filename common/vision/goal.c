#include "vision/goal.h"

#include "vision/camera.h"
#include "vision/correspondence.h"
#include "vision/depth.h"

/* Of goal_min, the shortest run that may be a goal, so many columns are the soft ends of the edge.
 */
#define SOFT_PX       4
#define PAIR_BONUS_PX 8
/* The left eye's edge lies this close to where the blocks match. */
#define EDGE_REACH_Q4 (3 * 16)

/* Black beside a single edge. */
#define MIN_BLACK_MM (2 * OPPONENT_RADIUS_MM + 15)

enum { LEFT_EDGE = 0, RIGHT_EDGE = 1, EDGE_COUNT = 2 };

typedef struct {
    const band_edge_t *edge; /* in the right eye; 0: none */
    int d_q4;                /* 0: not matched */
    int certainty;           /* 0..15 */
} goal_edge_t;

/* Level of the wall beside an edge of this side, and of the black. */
static int wall_level(const band_edge_t *edge, int side)
{
    return side == LEFT_EDGE ? edge->before : edge->after;
}

static int black_level(const band_edge_t *edge, int side)
{
    return side == LEFT_EDGE ? edge->after : edge->before;
}

/* What is darker than this belongs to the same black. */
static int black_limit(const band_edge_t *edge, int side)
{
    return (3 * black_level(edge, side) + wall_level(edge, side)) / 4;
}

/* Number of columns from x on, going by step, that are dark (1) or bright (0) against `limit`. */
static int run_length(const int16_t *profile, int x, int step, int limit, int dark)
{
    int length = 0;

    for (; x >= 0 && x < CAMERA_WIDTH_PX && (profile[x] < limit) == dark; x += step)
        length++;
    return length;
}

/* Columns of wall from x on, going by step: as bright as `level`, without a further step. */
static int wall_length(const int16_t *profile, int x, int step, int level)
{
    int length = 0;

    for (; x >= 0 && x < CAMERA_WIDTH_PX; x += step, length++)
        if (4 * profile[x] < 3 * level || 4 * profile[x] > 5 * level)
            break;
    return length;
}

static int is_goal_edge(const band_t *band, const eye_params_t *params, const band_edge_t *edge,
                        int side, const opponent_extent_t *opponent)
{
    const int16_t *profile = band->profile[EYE_RIGHT];
    int inwards = side == LEFT_EDGE ? 1 : -1;
    int wall = wall_level(edge, side);
    int x = (edge->x_q4 + 8) / 16;

    if (band_edge_rises(edge) != (side == RIGHT_EDGE) ||
        black_level(edge, side) > wall * params->goal_black / 256)
        return 0;
    if (opponent->seen && edge->x_q4 > opponent->first_q4 && edge->x_q4 < opponent->last_q4)
        return 0;
    if (run_length(profile, x + 2 * inwards, inwards, black_limit(edge, side), 1) <
        params->goal_min - SOFT_PX)
        return 0;
    return wall_length(profile, x - 2 * inwards, -inwards, wall) >= params->goal_wall;
}

static int is_covered(const opponent_extent_t *opponent, int x)
{
    return opponent->seen && 16 * x >= opponent->first_q4 && 16 * x <= opponent->last_q4;
}

/* Columns inwards from the edge that are black, or where the opponent stands before it. */
static int black_run(const band_t *band, const band_edge_t *edge, int side,
                     const opponent_extent_t *opponent)
{
    int step = side == LEFT_EDGE ? 1 : -1;
    int limit = black_limit(edge, side);
    int x = (edge->x_q4 + 8) / 16 + 2 * step;
    int length = 2;

    for (; x >= 0 && x < CAMERA_WIDTH_PX; x += step, length++)
        if (band->profile[EYE_RIGHT][x] >= limit && !is_covered(opponent, x))
            break;
    return length;
}

/* How many black columns a goal with these edges has, one of which may be missing; 0 if it cannot
 * be one. */
static int goal_score(const band_t *band, const eye_params_t *params, const band_edge_t *left,
                      const band_edge_t *right, const opponent_extent_t *opponent)
{
    const band_edge_t *edge = left ? left : right;
    int run;

    if (!edge)
        return 0;
    run = black_run(band, edge, left ? LEFT_EDGE : RIGHT_EDGE, opponent);
    if (run < params->goal_min)
        return 0;
    if (left && right && run < (right->x_q4 - left->x_q4) / 16 - 3)
        return 0;
    /* Two edges are more than either of them alone. */
    return left && right ? run + PAIR_BONUS_PX : run;
}

/* The pair of edges, either of which may be missing, with the longest black run between them. */
static void choose_edges(const band_t *band, const eye_params_t *params,
                         const opponent_extent_t *opponent, goal_edge_t goal[EDGE_COUNT])
{
    const band_edges_t *found = &band->edges[EYE_RIGHT];
    int best = 0;
    int i;
    int j;

    goal[LEFT_EDGE].edge = goal[RIGHT_EDGE].edge = 0;
    /* -1 and count stand for the frame's borders. */
    for (i = -1; i < found->count; i++) {
        const band_edge_t *left = i < 0 ? 0 : &found->edges[i];

        if (left && !is_goal_edge(band, params, left, LEFT_EDGE, opponent))
            continue;
        for (j = i + 1; j <= found->count; j++) {
            const band_edge_t *right = j == found->count ? 0 : &found->edges[j];
            int score;

            if ((!left && !right) ||
                (right && !is_goal_edge(band, params, right, RIGHT_EDGE, opponent)))
                continue;
            score = goal_score(band, params, left, right, opponent);
            if (score > best) {
                best = score;
                goal[LEFT_EDGE].edge = left;
                goal[RIGHT_EDGE].edge = right;
            }
        }
    }
}

/* The largest sum of differences at which two blocks still show the same edge: an eighth of what
 * black against wall would cost, which is half the block a quarter brighter, and the noise of a bad
 * camera (8 grey levels a pixel). */
static uint32_t similarity_limit(const band_edge_t *edge)
{
    int contrast =
        edge->after > edge->before ? edge->after - edge->before : edge->before - edge->after;

    return (uint32_t)(contrast * BLOCK_SIZE / 8 + 8 * BLOCK_SIZE * BLOCK_SIZE);
}

/* Whether the left eye's edge is of the same wall and the same black: the opponent before the
 * goal's edge, in that eye alone, shows edges too. */
static int is_same_edge(const band_t *band, const eye_params_t *params, const band_edge_t *left,
                        const band_edge_t *right, int side)
{
    int inwards = side == LEFT_EDGE ? 1 : -1;
    int a = wall_level(left, side);
    int b = wall_level(right, side);
    int brighter = a > b ? a : b;
    int x = (left->x_q4 + 8) / 16 + 2 * inwards;
    int run;

    /* Eyes that differ by 10 percent either way differ by less than a quarter. */
    if (4 * (a > b ? a - b : b - a) > brighter)
        return 0;
    run = run_length(band->profile[EYE_LEFT], x, inwards, black_limit(left, side), 1);
    /* The border may cut the black short. */
    return run >= params->goal_min - SOFT_PX || x + inwards * run < 0 ||
           x + inwards * run >= CAMERA_WIDTH_PX;
}

/* Match the edge's block in the left eye; fills disparity and certainty, 0 if it has no match. */
static void match_edge(const band_t *band, const eye_params_t *eye_params, int side,
                       goal_edge_t *goal)
{
    image_view_t views[EYE_COUNT];
    match_params_t params = {MATCH_SAD, BLOCK_SIZE,       BLOCK_SIZE, 1, 1, 0,
                             0,         CHECK_SIMILARITY, 0,          0, 0, 0};
    const band_edge_t *edge = goal->edge;
    const band_edge_t *left;
    match_t match;
    uint32_t second;
    int eye;

    goal->d_q4 = goal->certainty = 0;
    for (eye = 0; eye < EYE_COUNT; eye++) {
        views[eye].pixels = band->grey[eye][0];
        views[eye].width = views[eye].stride = CAMERA_WIDTH_PX;
        views[eye].height = BAND_ROWS;
    }
    params.disparity_max = eye_params->search_max;
    params.rows = eye_params->match_rows;
    params.similarity_limit = similarity_limit(edge);
    if (match_find(&views[EYE_LEFT], &views[EYE_RIGHT], (edge->x_q4 + 16) / 16, BAND_LINE, &params,
                   &match) != MATCH_OK ||
        match.failed)
        return;
    left = band_nearest_edge(band, EYE_LEFT, (int16_t)(edge->x_q4 + match.disparity_q4),
                             band_edge_rises(edge), EDGE_REACH_Q4);
    if (!left || left->x_q4 - edge->x_q4 < (int)DEPTH_MIN_DISPARITY_Q4 ||
        !is_same_edge(band, eye_params, left, edge, side))
        return;
    goal->d_q4 = left->x_q4 - edge->x_q4;
    /* A place beside the right one that costs twice as much is certainty enough. */
    second = match.second_cost > 2 * match.cost + 64 ? 2 * match.cost + 64 : match.second_cost;
    goal->certainty = (int)(15u * (second - match.cost) / (match.cost + 64));
}

/* Whether what is beside the edge at this disparity may be a white stripe of the opponent, too
 * little of whom is seen to know him: it ends, other than at the border, within a stripe's width.
 */
static int is_stripe_beside(const band_t *band, int stripe_max_mm, const goal_edge_t *goal,
                            int side)
{
    int outwards = side == LEFT_EDGE ? -1 : 1;
    int x = (goal->edge->x_q4 + 8) / 16 + 2 * outwards;
    int length = wall_length(band->profile[EYE_RIGHT], x, outwards, wall_level(goal->edge, side));
    int end = x + outwards * length;

    return end > 1 && end < CAMERA_WIDTH_PX - 2 &&
           16 * length * (CAMERA_BASELINE_UM / 100) < goal->d_q4 * stripe_max_mm * 10;
}

/* Distance between the points seen at both edges, mm; beyond `most_mm` it is not exact. */
static int width_between_mm(const goal_edge_t goal[EDGE_COUNT], int most_mm)
{
    int32_t z[EDGE_COUNT];
    int32_t x[EDGE_COUNT];
    int32_t square;
    int32_t root = 0;
    int i;

    for (i = 0; i < EDGE_COUNT; i++) {
        z[i] = CAMERA_FOCAL_BASELINE_Q8 / goal[i].d_q4 / 16;
        x[i] =
            (goal[i].edge->x_q4 - CAMERA_CX_Q4) * (CAMERA_BASELINE_UM / 100) / (10 * goal[i].d_q4);
    }
    square = (x[1] - x[0]) * (x[1] - x[0]) + (z[1] - z[0]) * (z[1] - z[0]);
    while (root <= most_mm && (root + 1) * (root + 1) <= square)
        root++;
    return (int)root;
}

/* Two edges that are not a goal's width apart are not both a goal's. Black that is too narrow is
 * something else altogether, the opponent's dark head, say. Of edges too far apart the nearer
 * belongs to what hides the goal. */
static void drop_impossible(int slack_percent, goal_edge_t goal[EDGE_COUNT])
{
    int min_mm = GOAL_WIDTH_MM * (100 - slack_percent) / 100;
    int max_mm = GOAL_WIDTH_MM * (100 + slack_percent) / 100;
    int width_mm;

    if (!goal[LEFT_EDGE].d_q4 || !goal[RIGHT_EDGE].d_q4)
        return;
    width_mm = width_between_mm(goal, max_mm);
    if (width_mm < min_mm)
        goal[LEFT_EDGE].d_q4 = goal[RIGHT_EDGE].d_q4 = 0;
    else if (width_mm > max_mm)
        goal[goal[LEFT_EDGE].d_q4 > goal[RIGHT_EDGE].d_q4 ? LEFT_EDGE : RIGHT_EDGE].d_q4 = 0;
}

/* An edge alone, the other one out of the picture or hidden, needs more black beside it than a
 * robot is wide: else it may be his dark head. */
static void drop_narrow(const band_t *band, const opponent_extent_t *opponent,
                        goal_edge_t goal[EDGE_COUNT])
{
    int side;

    for (side = LEFT_EDGE; side < EDGE_COUNT; side++) {
        if (!goal[side].d_q4 || goal[1 - side].d_q4)
            continue;
        if (16 * black_run(band, goal[side].edge, side, opponent) * (CAMERA_BASELINE_UM / 100) <
            goal[side].d_q4 * MIN_BLACK_MM * 10)
            goal[side].d_q4 = 0;
    }
}

void goal_find(const band_t *band, const eye_params_t *params, const opponent_extent_t *opponent,
               report_t *report)
{
    static const uint16_t flags[EDGE_COUNT] = {REPORT_GOAL_LEFT_EDGE, REPORT_GOAL_RIGHT_EDGE};
    goal_edge_t goal[EDGE_COUNT] = {{0, 0, 0}, {0, 0, 0}};
    int certainty = 0;
    int seen = 0;
    int i;

    choose_edges(band, params, opponent, goal);
    for (i = 0; i < EDGE_COUNT; i++)
        if (goal[i].edge) {
            match_edge(band, params, i, &goal[i]);
            if (goal[i].d_q4 && is_stripe_beside(band, params->stripe_max, &goal[i], i))
                goal[i].d_q4 = 0;
        }
    drop_impossible(params->goal_slack, goal);
    drop_narrow(band, opponent, goal);
    for (i = 0; i < EDGE_COUNT; i++) {
        if (!goal[i].d_q4)
            continue;
        report->flags |= flags[i];
        report->goal_x_q4[i] = (uint16_t)(goal[i].edge->x_q4 < 0 ? 0 : goal[i].edge->x_q4);
        report->goal_disparity_q4[i] = (uint16_t)goal[i].d_q4;
        certainty += goal[i].certainty;
        seen++;
    }
    if (seen)
        report->goal_confidence = (uint8_t)(certainty / seen < 1 ? 1 : certainty / seen);
}
