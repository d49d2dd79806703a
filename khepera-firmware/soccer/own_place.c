#include "soccer/own_place.h"

#include "soccer/pitch.h"
#include "soccer/plane.h"

#define LOST_SIGMA_MM         300
/* Heading variance: unit (1/65536 turn)^2 / 16. One degree at the kick-off (a human's eye). */
#define HEADING_VAR_START     (182L * 182 / 16)
#define HEADING_VAR_MAX       (3640L * 3640 / 16)
/* What travel adds: wheels and wheel base are known to a percent, and slip. */
#define POSITION_VAR_PER_STEP 1 /* mm^2 each 16 mm of travel */
#define STEP_COUNTS           384
#define HEADING_VAR_PER_TURN  (110L * 110 / 16) /* 0.6 degrees each 45 degrees, or each 64 mm */
#define TURN_COUNTS           1000
#define POSITION_VAR_FLOOR    16
/* Share of an error that repeats from frame to frame, so that averaging many does not make it
 * smaller. */
#define SYSTEMATIC_FACTOR     4
#define GATE_SIGMAS           3
#define GATE_SLACK_MM         40
#define WALL_GATE_SLACK_MM    15
#define DOUBTS_MAX            5
#define DOUBT_MM              60                /* what one of them adds, */
#define DOUBT_HEADING_VAR     (728L * 728 / 16) /* ... to the heading 4 degrees */
/* A single post may be anything upright and dark: it counts less, and once the place is known only
 * near to where it must be. */
#define SINGLE_FACTOR         4
#define SINGLE_GATE_MM        90
#define SINGLE_GATE_NEAR_MM   35
/* Which goal is it? Not asked of a single post when looking along the goal lines, beyond 65
 * degrees, nor of two that stand across by as much. */
#define SIDE_COS_MIN_Q14      6900
#define SIDE_ERROR_MAX        ANGLE_DEGREES(75)
/* Two feet of a wall lie on one that runs along x or y if they are no farther apart across it than
 * that part of the way along it; ... */
#define ALONG_WALL_DIVISOR    3
/* ... not in the cut corners, that much around. */
#define CORNER_MM             70
/* 65536 / (2 pi): mm across for a mm of range, as an angle. */
#define RADIAN                10430

/* ---- How certain ---- */

void own_place_start(own_place_t *own, const soccer_tuning_t *tuning)
{
    own->position_var[0] = (int32_t)tuning->kick_off_sigma_mm * tuning->kick_off_sigma_mm;
    own->position_var[1] = own->position_var[0];
    own->heading_var = HEADING_VAR_START;
    own->travel_rest = 0;
    own->spin_rest = 0;
    own->doubts = 0;
    own->localised = 0;
}

void own_place_blur(own_place_t *own, int32_t position_var, int32_t heading_var)
{
    int32_t most = (int32_t)LOST_SIGMA_MM * LOST_SIGMA_MM;

    own->position_var[0] = plane_clamp(own->position_var[0] + position_var, 0, most);
    own->position_var[1] = plane_clamp(own->position_var[1] + position_var, 0, most);
    own->heading_var = plane_clamp(own->heading_var + heading_var, 0, HEADING_VAR_MAX);
}

void own_place_travel(own_place_t *own, const int32_t counts[2])
{
    int32_t forward = counts[0] + counts[1];
    int32_t turn = counts[1] - counts[0];
    int32_t travel = forward < 0 ? -forward : forward;
    int32_t spin = turn < 0 ? -turn : turn;
    int32_t position_var = 0;
    int32_t heading_var = 0;

    /* Counts of both wheels together: 24 a mm. 45 degrees are 1000 counts of difference. */
    own->travel_rest += travel;
    own->spin_rest += spin + travel / 2;
    for (; own->travel_rest >= STEP_COUNTS; own->travel_rest -= STEP_COUNTS)
        position_var += POSITION_VAR_PER_STEP;
    for (; own->spin_rest >= TURN_COUNTS; own->spin_rest -= TURN_COUNTS)
        heading_var += HEADING_VAR_PER_TURN;
    if (position_var != 0 || heading_var != 0)
        own_place_blur(own, position_var, heading_var);
}

/* A whole goal or a wall was seen where none should be: be less sure. */
static void doubt(own_place_t *own)
{
    if (own->doubts < UINT8_MAX)
        own->doubts++;
    own_place_blur(own, (int32_t)DOUBT_MM * DOUBT_MM, DOUBT_HEADING_VAR);
}

static void now_certain(own_place_t *own, const soccer_tuning_t *tuning)
{
    int32_t most = (int32_t)tuning->localised_sigma_mm * tuning->localised_sigma_mm;

    if (own->position_var[0] < most && own->position_var[1] < most)
        own->localised = 1;
}

/* ---- Goals ---- */

/* The error of heading that a whole goal tells if it is that on `side`. */
static angle_t heading_error(const pose_t *then, const place_t edge[2], int side)
{
    angle_t seen =
        angle_of(edge[1].forward_mm - edge[0].forward_mm, edge[1].left_mm - edge[0].left_mm);

    /* From the left post to the right one: along -y at the opponent's goal, +y at the own. */
    return angle_wrap((side > 0 ? -ANGLE_90 : ANGLE_90) - seen - then->heading);
}

/* Which goal is seen: 1 the opponent's, -1 the own, 0 cannot be told. */
static int goal_side(const pose_t *then, const place_t edge[2])
{
    const place_t *any = edge[0].valid ? &edge[0] : &edge[1];
    int32_t cosine;

    if (edge[0].valid && edge[1].valid) {
        angle_t error = heading_error(then, edge, 1);

        if (error < SIDE_ERROR_MAX && error > -SIDE_ERROR_MAX)
            return 1;
        error = angle_wrap(error + 2 * ANGLE_90);
        return error < SIDE_ERROR_MAX && error > -SIDE_ERROR_MAX ? -1 : 0;
    }
    cosine = angle_cos_q14(angle_wrap(then->heading + angle_of(any->forward_mm, any->left_mm)));
    if (cosine > SIDE_COS_MIN_Q14)
        return 1;
    return cosine < -SIDE_COS_MIN_Q14 ? -1 : 0;
}

/* The heading that makes both posts lie on the goal line, weighed against what is believed. */
static angle_t heading_change(own_place_t *own, const pose_t *then, const place_t edge[2], int side)
{
    int32_t error = heading_error(then, edge, side);
    /* Root mean square of both, over the goal's width, in 1/65536 turns: 10430 / (1.4 * 300). */
    int32_t sigma = (int32_t)(edge[0].sigma_mm + edge[1].sigma_mm) * 25;
    int32_t var = sigma * sigma / 16 * SYSTEMATIC_FACTOR + 1;
    int32_t gain_q8 = 256 * own->heading_var / (own->heading_var + var);

    if (own->doubts < DOUBTS_MAX &&
        error * error / 16 > GATE_SIGMAS * GATE_SIGMAS * (own->heading_var + var))
        return 0;
    own->heading_var -= own->heading_var * gain_q8 / 256;
    return angle_wrap(error * gain_q8 / 256);
}

/* One post seen in the robot's frame tells the position; average of those seen. Returns how many.
 */
static unsigned position_error(const pose_t *then, const place_t edge[2], int side, pose_t *error,
                               int32_t *var)
{
    rotation_t turn;
    unsigned seen = 0;
    unsigned i;

    rotation_by(then->heading, &turn);
    error->x_q4 = 0;
    error->y_q4 = 0;
    error->heading = 0;
    *var = 0;
    for (i = 0; i < 2; i++) {
        int32_t x_q4;
        int32_t y_q4;

        if (!edge[i].valid)
            continue;
        place_in_field(then, &turn, &edge[i], &x_q4, &y_q4);
        error->x_q4 += side * PITCH_HALF_LENGTH_MM * 16 - x_q4;
        error->y_q4 += side * (i == 0 ? GOAL_HALF_WIDTH_MM : -GOAL_HALF_WIDTH_MM) * 16 - y_q4;
        *var += (int32_t)edge[i].sigma_mm * edge[i].sigma_mm;
        seen++;
    }
    if (seen == 2) {
        error->x_q4 /= 2;
        error->y_q4 /= 2;
        *var /= 4;
    }
    return seen;
}

/* How far off a single post may be: the nearer it is, the better its place is known. */
static int32_t single_gate_mm(const place_t edge[2])
{
    const place_t *post = edge[0].valid ? &edge[0] : &edge[1];

    return plane_clamp(SINGLE_GATE_NEAR_MM + GATE_SIGMAS * (int32_t)post->sigma_mm, 0,
                       SINGLE_GATE_MM);
}

/* Believe a share of an error of x or y. Returns the change. */
static int32_t take_share(int32_t *var, int32_t seen_var, int32_t error_q4)
{
    int32_t gain_q8 = 256 * *var / (*var + seen_var);

    *var -= *var * gain_q8 / 256;
    return error_q4 * gain_q8 / 256;
}

int own_place_see_goal(own_place_t *own, const soccer_tuning_t *tuning, const place_t edge[2],
                       const pose_t *then, pose_t *change)
{
    int side;
    pose_t pose = *then;
    pose_t error;
    int32_t var;
    int32_t most_var;
    int32_t off_mm;
    int32_t gate_mm;
    unsigned seen;

    if (!edge[0].valid && !edge[1].valid)
        return 0;
    side = goal_side(then, edge);
    if (side == 0)
        return 0;
    change->heading = 0;
    if (edge[0].valid && edge[1].valid)
        change->heading = heading_change(own, then, edge, side);
    pose.heading = angle_wrap(pose.heading + change->heading);
    seen = position_error(&pose, edge, side, &error, &var);
    if (!pitch_contains(pose.x_q4 + error.x_q4, pose.y_q4 + error.y_q4, tuning->wall_slack_mm))
        return 0;

    var = var * SYSTEMATIC_FACTOR * (seen == 1 ? SINGLE_FACTOR : 1) + POSITION_VAR_FLOOR;
    most_var = own->position_var[own->position_var[1] > own->position_var[0]] + var;
    off_mm = (int32_t)length_of(error.x_q4, error.y_q4) / 16;
    gate_mm = GATE_SIGMAS * (int32_t)square_root((uint32_t)most_var) + GATE_SLACK_MM;
    if (seen == 1 && own->localised)
        gate_mm = plane_clamp(gate_mm, 0, single_gate_mm(edge));
    if (off_mm > gate_mm) {
        /* Once is an error of the eye; again and again it is one of ours: wheels slipped. */
        if (seen == 2)
            doubt(own);
        if (seen == 1 || own->doubts < DOUBTS_MAX)
            return 0;
    }
    own->doubts = 0;
    change->x_q4 = take_share(&own->position_var[0], var, error.x_q4);
    change->y_q4 = take_share(&own->position_var[1], var, error.y_q4);
    now_certain(own, tuning);
    return 1;
}

/* ---- Walls ---- */

/* A foot of the wall in the field. */
typedef struct {
    int32_t x_mm;
    int32_t y_mm;
    int32_t dx_mm; /* from the robot */
    int32_t dy_mm;
    int32_t var; /* of its range, mm^2; 0 = not seen */
    int wall;    /* 0 = one across x, 1 = one across y, -1 = cannot be told */
} foot_t;

static int32_t size_of(int32_t value)
{
    return value < 0 ? -value : value;
}

static int in_corner(const foot_t *foot)
{
    return size_of(foot->x_mm) > PITCH_HALF_LENGTH_MM - PITCH_CORNER_MM - CORNER_MM &&
           size_of(foot->y_mm) > PITCH_HALF_WIDTH_MM - PITCH_CORNER_MM - CORNER_MM;
}

/* Two feet on one wall tell which way it runs, wherever the robot is. */
static void tell_wall(foot_t *one, foot_t *other)
{
    int32_t dx;
    int32_t dy;
    int wall = -1;

    if (one->var == 0 || other->var == 0)
        return;
    dx = size_of(other->x_mm - one->x_mm);
    dy = size_of(other->y_mm - one->y_mm);
    if (dx < dy / ALONG_WALL_DIVISOR)
        wall = 0;
    else if (dy < dx / ALONG_WALL_DIVISOR)
        wall = 1;
    if (wall < 0)
        return;
    if (one->wall < 0)
        one->wall = wall;
    if (other->wall < 0)
        other->wall = wall;
}

/* A single foot lies on the wall that it is nearest to, if that is clear. */
static int nearest_wall(const foot_t *foot)
{
    int32_t off_x = size_of(PITCH_HALF_LENGTH_MM - size_of(foot->x_mm));
    int32_t off_y = size_of(PITCH_HALF_WIDTH_MM - size_of(foot->y_mm));

    if (off_x * 3 < off_y)
        return 0;
    return off_y * 3 < off_x ? 1 : -1;
}

/* One foot corrects across its wall, and the heading by its distance along it. Returns 1 if it
 * fits, -1 if it contradicts, 0 if it tells nothing. */
static int see_foot(own_place_t *own, const foot_t *foot, pose_t *change)
{
    int x_wall = foot->wall == 0;
    /* How far the foot moves across the wall when the robot turns. */
    int32_t lever_mm = x_wall ? -foot->dy_mm : foot->dx_mm;
    int32_t half_mm = x_wall ? PITCH_HALF_LENGTH_MM : PITCH_HALF_WIDTH_MM;
    int32_t at_mm = x_wall ? foot->x_mm : foot->y_mm;
    int32_t side = (x_wall ? foot->dx_mm : foot->dy_mm) > 0 ? 1 : -1;
    int32_t *position_var = &own->position_var[x_wall ? 0 : 1];
    int32_t *moved_q4 = x_wall ? &change->x_q4 : &change->y_q4;
    int32_t error_q4 =
        16 * (side * half_mm - at_mm) - *moved_q4 - lever_mm * 16 * change->heading / RADIAN;
    /* Covariances of the foot's place with the heading, mm / 65536 turn, and with itself. */
    int32_t turn_covar = lever_mm * own->heading_var / (RADIAN / 16);
    int32_t turn_var = turn_covar * lever_mm / RADIAN;
    int32_t total = *position_var + turn_var + foot->var;
    int32_t error_mm = error_q4 / 16;

    if (error_mm * error_mm >
        GATE_SIGMAS * GATE_SIGMAS * total + WALL_GATE_SLACK_MM * WALL_GATE_SLACK_MM)
        return -1;
    change->heading = angle_wrap(change->heading + turn_covar / 16 * error_q4 / total);
    *moved_q4 += error_q4 * (256 * *position_var / total) / 256;
    *position_var -= *position_var * (256 * *position_var / total) / 256;
    own->heading_var -= own->heading_var * (256 * turn_var / total) / 256;
    return 1;
}

int own_place_see_walls(own_place_t *own, const soccer_tuning_t *tuning,
                        const place_t wall[REPORT_WALL_COLUMNS], const pose_t *then, pose_t *change)
{
    foot_t feet[REPORT_WALL_COLUMNS];
    rotation_t turn;
    unsigned fit = 0;
    unsigned unfit = 0;
    unsigned i;

    change->x_q4 = 0;
    change->y_q4 = 0;
    change->heading = 0;
    rotation_by(then->heading, &turn);
    for (i = 0; i < REPORT_WALL_COLUMNS; i++) {
        foot_t *foot = &feet[i];

        foot->wall = -1;
        foot->var = wall[i].valid ? (int32_t)wall[i].sigma_mm * wall[i].sigma_mm : 0;
        if (foot->var == 0)
            continue;
        place_in_field(then, &turn, &wall[i], &foot->x_mm, &foot->y_mm);
        foot->x_mm >>= 4;
        foot->y_mm >>= 4;
        foot->dx_mm = foot->x_mm - (then->x_q4 >> 4);
        foot->dy_mm = foot->y_mm - (then->y_q4 >> 4);
        if (own->localised && in_corner(foot))
            foot->var = 0;
    }
    for (i = 0; i + 1 < REPORT_WALL_COLUMNS; i++)
        tell_wall(&feet[i], &feet[i + 1]);
    for (i = 0; i < REPORT_WALL_COLUMNS; i++) {
        int told = feet[i].wall >= 0;
        int fits;

        if (feet[i].var == 0)
            continue;
        if (!told && own->localised)
            feet[i].wall = nearest_wall(&feet[i]);
        if (feet[i].wall < 0)
            continue;
        fits = see_foot(own, &feet[i], change);
        fit += fits > 0;
        unfit += fits < 0 && told;
    }
    if (fit == 0 && unfit >= 2)
        doubt(own);
    if (fit == 0)
        return 0;
    if (unfit == 0)
        own->doubts = 0;
    now_certain(own, tuning);
    return 1;
}
