#include "soccer/world.h"

#include "vision/camera.h"

#define START_X_MM            (-262)
#define START_SIGMA_MM        220
#define LOST_SIGMA_MM         300
#define LOCALISED_SIGMA_MM    60
/* Heading variance: unit (1/65536 turn)^2 / 16. One degree at the kick-off (a human's eye). */
#define HEADING_VAR_START     (182L * 182 / 16)
#define HEADING_VAR_MAX       (3640L * 3640 / 16)
/* What travel adds: wheels slip a little, more so when something is pushed. */
#define POSITION_VAR_PER_STEP 1 /* mm^2 each 16 mm of travel */
#define STEP_COUNTS           384
#define HEADING_VAR_PER_TURN  (36L * 36 / 16) /* 0.2 degrees each 45 degrees, or each 64 mm */
#define POSITION_VAR_FLOOR    16
/* Goal sightings: share of an error that repeats from frame to frame, so that averaging many does
 * not make it smaller. */
#define SYSTEMATIC_FACTOR     4
#define GATE_SIGMAS           3
#define GATE_SLACK_MM         40
#define DOUBTS_MAX            12
#define DOUBT_MM              25                /* what one of them adds, */
#define DOUBT_HEADING_VAR     (273L * 273 / 16) /* ... to the heading 1.5 degrees */
/* A single post may be anything upright and dark: it counts less, and once the place is known only
 * near to where it must be. */
#define SINGLE_FACTOR         4
#define SINGLE_GATE_MM        90
#define SINGLE_GATE_NEAR_MM   35
/* Which goal is it? Not asked when looking along the goal lines, beyond 65 degrees. */
#define SIDE_COS_MIN_Q14      6900

#define BALL_GATE_MM         60
#define BALL_DOUBTS_MAX      3
/* The ball's rolling loss, mm/s each tick: 0.2 m/s^2. An assumption; the filter corrects it. */
#define BALL_SLOWING_MM_S    2
#define BALL_SPEED_MAX_MM_S  1000
#define ROLLS_MM_S           100u /* below, the speed is mostly noise */
#define IN_PITCH_SLACK_MM    40
#define WALL_SLACK_MM        15
/* Nearer than that, middle to middle, two robots overlap; only asked of a fresh sighting. */
#define OVERLAP_MM           50
#define OPPONENT_FRESH_TICKS 300
#define CONTACT_MM           (BALL_RADIUS + ROBOT_RADIUS)
/* Where an object must be to be expected in view. */
#define VIEW_NEAR_MM         150
#define VIEW_FAR_MM          900
#define VIEW_HALF_ANGLE      ANGLE_DEGREES(19)
/* Whether it should be in view is asked only so often: it costs a square root and an angle. */
#define LOOK_TICKS           4u

static int32_t clamp(int32_t value, int32_t low, int32_t high)
{
    if (value < low)
        return low;
    return value > high ? high : value;
}

static void count_up(uint16_t *ticks)
{
    if (*ticks < UINT16_MAX)
        (*ticks)++;
}

/* |x|, |y| <= 60000, 3.7 m in 1/16 mm: everything on the pitch, seen from a belief about the robot
 * that odometry keeps within 2 m. */
static void rotate(angle_t angle, int32_t x, int32_t y, int32_t *to_x, int32_t *to_y)
{
    int32_t cosine = angle_cos_q14(angle);
    int32_t sine = angle_sin_q14(angle);

    *to_x = (x * cosine - y * sine) >> 14;
    *to_y = (x * sine + y * cosine) >> 14;
}

/* ---- Start ---- */

static void forget(object_t *object)
{
    static const object_t nothing;

    *object = nothing;
    object->age_ticks = UINT16_MAX;
}

void world_start(world_t *world, angle_t heading)
{
    pose_t pose;
    unsigned i;

    pose.x_q4 = START_X_MM * 16;
    pose.y_q4 = 0;
    pose.heading = heading;
    odometry_set(&world->odometry, &pose);
    for (i = 0; i < WORLD_HISTORY; i++)
        world->history[i] = pose;
    world->newest = 0;
    world->position_var = (int32_t)START_SIGMA_MM * START_SIGMA_MM;
    world->heading_var = HEADING_VAR_START;
    world->travel_rest = 0;
    world->spin_rest = 0;
    world->position_doubts = 0;
    world->wall_ticks = 0;
    world->localised = 0;
    world->last_ball_bearing = heading;
    world->goal_age_ticks = UINT16_MAX;
    forget(&world->ball);
    forget(&world->opponent);
}

uint16_t world_position_sigma_mm(const world_t *world)
{
    return (uint16_t)square_root((uint32_t)world->position_var);
}

/* ---- Time passes ---- */

static void grow_uncertain(world_t *world, const int32_t counts[2])
{
    int32_t forward = counts[0] + counts[1];
    int32_t turn = counts[1] - counts[0];
    int32_t travel = (forward < 0 ? -forward : forward);
    int32_t spin = (turn < 0 ? -turn : turn);

    /* Counts of both wheels together: 24 a mm. 45 degrees are 1000 counts of difference. */
    world->travel_rest += travel;
    world->spin_rest += spin + travel / 2;
    while (world->travel_rest >= STEP_COUNTS) {
        world->travel_rest -= STEP_COUNTS;
        world->position_var += POSITION_VAR_PER_STEP;
    }
    while (world->spin_rest >= 1000) {
        world->spin_rest -= 1000;
        world->heading_var += HEADING_VAR_PER_TURN;
    }
    world->position_var = clamp(world->position_var, 0, (int32_t)LOST_SIGMA_MM * LOST_SIGMA_MM);
    world->heading_var = clamp(world->heading_var, 0, HEADING_VAR_MAX);
}

static int32_t slower(int32_t speed_mm_s)
{
    if (speed_mm_s > BALL_SLOWING_MM_S)
        return speed_mm_s - BALL_SLOWING_MM_S;
    return speed_mm_s < -BALL_SLOWING_MM_S ? speed_mm_s + BALL_SLOWING_MM_S : 0;
}

/* The ball rolls on, stays on the pitch, and is not where the robot is. */
static void roll(world_t *world, const pose_t *pose)
{
    object_t *ball = &world->ball;
    int in_mouth = ball->y_q4 < GOAL_HALF_WIDTH_MM * 16 && ball->y_q4 > -GOAL_HALF_WIDTH_MM * 16;
    int32_t limit_x =
        (PITCH_HALF_LENGTH_MM + (in_mouth ? GOAL_DEPTH_MM : 0) - BALL_RADIUS + 10) * 16;
    int32_t limit_y = (PITCH_HALF_WIDTH_MM - BALL_RADIUS + 10) * 16;
    int32_t dx;
    int32_t dy;
    int32_t distance;

    /* mm/s * 10 ms * 16 = 4/25 of a q4 step. */
    ball->x_q4 = clamp(ball->x_q4 + ball->vx_mm_s * 4 / 25, -limit_x, limit_x);
    ball->y_q4 = clamp(ball->y_q4 + ball->vy_mm_s * 4 / 25, -limit_y, limit_y);
    ball->vx_mm_s = slower(ball->vx_mm_s);
    ball->vy_mm_s = slower(ball->vy_mm_s);
    dx = ball->x_q4 - pose->x_q4;
    dy = ball->y_q4 - pose->y_q4;
    if (dx >= CONTACT_MM * 16 || dx <= -CONTACT_MM * 16 || dy >= CONTACT_MM * 16 ||
        dy <= -CONTACT_MM * 16)
        return;
    distance = (int32_t)length_of(dx, dy);
    if (distance < CONTACT_MM * 16 && distance > 0) {
        ball->x_q4 = pose->x_q4 + dx * CONTACT_MM * 16 / distance;
        ball->y_q4 = pose->y_q4 + dy * CONTACT_MM * 16 / distance;
    }
}

static int in_view(const object_t *object, const pose_t *pose)
{
    int32_t dx = object->x_q4 - pose->x_q4;
    int32_t dy = object->y_q4 - pose->y_q4;
    int32_t distance_mm = (int32_t)length_of(dx, dy) / 16;
    angle_t bearing = angle_wrap(angle_of(dx, dy) - pose->heading);

    return distance_mm > VIEW_NEAR_MM && distance_mm < VIEW_FAR_MM && bearing < VIEW_HALF_ANGLE &&
           bearing > -VIEW_HALF_ANGLE;
}

static void grow_old(object_t *object, const pose_t *pose, int look)
{
    if (!object->known)
        return;
    count_up(&object->age_ticks);
    if (look && object->unseen_ticks < UINT16_MAX - LOOK_TICKS && in_view(object, pose))
        object->unseen_ticks = (uint16_t)(object->unseen_ticks + LOOK_TICKS);
}

/* Does the belief overlap with an opponent that was seen lately? */
static int in_opponent(const world_t *world)
{
    const object_t *opponent = &world->opponent;
    int32_t dx = world->odometry.x_q16 / 4096 - opponent->x_q4;
    int32_t dy = world->odometry.y_q16 / 4096 - opponent->y_q4;

    return opponent->known && opponent->age_ticks < OPPONENT_FRESH_TICKS && dx < OVERLAP_MM * 16 &&
           dx > -OVERLAP_MM * 16 && dy < OVERLAP_MM * 16 && dy > -OVERLAP_MM * 16 &&
           length_of(dx, dy) < OVERLAP_MM * 16;
}

/* No robot drives through a wall or through another one: where odometry says so, the wheels slip.
 * `before`: odometry before this tick. */
static void stay_on_pitch(world_t *world, const odometry_t *before)
{
    int32_t in_goal =
        before->y_q16 < GOAL_HALF_WIDTH_MM * 65536 && before->y_q16 > -GOAL_HALF_WIDTH_MM * 65536
            ? GOAL_DEPTH_MM
            : 0;
    int32_t limit_x = (PITCH_HALF_LENGTH_MM + in_goal - ROBOT_RADIUS + WALL_SLACK_MM) * 65536;
    int32_t limit_y = (PITCH_HALF_WIDTH_MM - ROBOT_RADIUS + WALL_SLACK_MM) * 65536;
    int32_t x = clamp(world->odometry.x_q16, -limit_x, limit_x);
    int32_t y = clamp(world->odometry.y_q16, -limit_y, limit_y);
    int held = x != world->odometry.x_q16 || y != world->odometry.y_q16;

    if (!world->localised)
        return;
    world->odometry.x_q16 = x;
    world->odometry.y_q16 = y;
    if (in_opponent(world)) {
        world->odometry.x_q16 = before->x_q16;
        world->odometry.y_q16 = before->y_q16;
        held = 1;
    }
    if (held)
        count_up(&world->wall_ticks);
    else
        world->wall_ticks = 0;
}

void world_tick(world_t *world, const int32_t counts[2])
{
    const odometry_t before = world->odometry;
    pose_t pose;
    int look;

    odometry_add(&world->odometry, counts[0], counts[1]);
    if (counts[0] != 0 || counts[1] != 0)
        stay_on_pitch(world, &before);
    odometry_pose(&world->odometry, &pose);
    world->newest = (uint8_t)((world->newest + 1u) % WORLD_HISTORY);
    world->history[world->newest] = pose;
    grow_uncertain(world, counts);
    count_up(&world->goal_age_ticks);
    look = world->newest % LOOK_TICKS == 0;
    grow_old(&world->ball, &pose, look);
    grow_old(&world->opponent, &pose, look);
    if (world->ball.known)
        roll(world, &pose);
}

/* ---- Sightings ---- */

/* The pose `age_100us` ago, between two ticks interpolated. */
static void pose_then(const world_t *world, uint32_t age_100us, pose_t *pose)
{
    uint32_t back = age_100us / WORLD_TICK_100US;
    int32_t part = (int32_t)(age_100us % WORLD_TICK_100US);
    const pose_t *after;
    const pose_t *before;

    if (back > WORLD_HISTORY - 2) {
        back = WORLD_HISTORY - 2;
        part = WORLD_TICK_100US;
    }
    after = &world->history[(world->newest + WORLD_HISTORY - back) % WORLD_HISTORY];
    before = &world->history[(world->newest + WORLD_HISTORY - back - 1) % WORLD_HISTORY];
    pose->x_q4 = after->x_q4 + (before->x_q4 - after->x_q4) * part / (int32_t)WORLD_TICK_100US;
    pose->y_q4 = after->y_q4 + (before->y_q4 - after->y_q4) * part / (int32_t)WORLD_TICK_100US;
    pose->heading = angle_wrap(after->heading + angle_wrap(before->heading - after->heading) *
                                                    part / (int32_t)WORLD_TICK_100US);
}

static void to_field(const pose_t *pose, const place_t *place, int32_t *x_q4, int32_t *y_q4)
{
    rotate(pose->heading, place->forward_mm * 16, place->left_mm * 16, x_q4, y_q4);
    *x_q4 += pose->x_q4;
    *y_q4 += pose->y_q4;
}

/* Turn and shift one thing along with the robot: what was seen relative to it stays so. */
static void carry(int32_t *x_q4, int32_t *y_q4, const pose_t *pivot, const pose_t *change)
{
    int32_t x;
    int32_t y;

    rotate(change->heading, *x_q4 - pivot->x_q4, *y_q4 - pivot->y_q4, &x, &y);
    *x_q4 = pivot->x_q4 + change->x_q4 + x;
    *y_q4 = pivot->y_q4 + change->y_q4 + y;
}

/* Correct the belief by `change`, seen from where the robot was: `pivot`. */
static void correct(world_t *world, const pose_t *pivot, const pose_t *change)
{
    pose_t now;
    unsigned i;

    for (i = 0; i < WORLD_HISTORY; i++) {
        pose_t *pose = &world->history[i];

        carry(&pose->x_q4, &pose->y_q4, pivot, change);
        pose->heading = angle_wrap(pose->heading + change->heading);
    }
    if (world->ball.known)
        carry(&world->ball.x_q4, &world->ball.y_q4, pivot, change);
    if (world->opponent.known)
        carry(&world->opponent.x_q4, &world->opponent.y_q4, pivot, change);
    odometry_pose(&world->odometry, &now);
    carry(&now.x_q4, &now.y_q4, pivot, change);
    world->odometry.x_q16 = now.x_q4 * 4096;
    world->odometry.y_q16 = now.y_q4 * 4096;
    world->odometry.heading_q32 += (uint32_t)(uint16_t)change->heading << 16;
}

/* The heading that makes both posts lie on the goal line, weighed against what is believed. */
static angle_t heading_change(world_t *world, const pose_t *then, const place_t edge[2], int side)
{
    angle_t seen =
        angle_of(edge[1].forward_mm - edge[0].forward_mm, edge[1].left_mm - edge[0].left_mm);
    /* From the left post to the right one: along -y at the opponent's goal, +y at the own. */
    angle_t true_direction = (angle_t)(side > 0 ? -ANGLE_90 : ANGLE_90);
    int32_t error = angle_wrap(true_direction - seen - then->heading);
    /* Root mean square of both, over the goal's width, in 1/65536 turns: 10430 / (1.4 * 300). */
    int32_t sigma = (int32_t)(edge[0].sigma_mm + edge[1].sigma_mm) * 25;
    int32_t var = sigma * sigma / 16 * SYSTEMATIC_FACTOR + 1;
    int32_t gain_q8 = 256 * world->heading_var / (world->heading_var + var);

    if (error * error / 16 > GATE_SIGMAS * GATE_SIGMAS * (world->heading_var + var))
        return 0;
    world->heading_var -= world->heading_var * gain_q8 / 256;
    return angle_wrap(error * gain_q8 / 256);
}

/* One post seen in the robot's frame tells the position; average of those seen. Returns how many.
 */
static unsigned position_error(const pose_t *then, const place_t edge[2], int side, pose_t *error,
                               int32_t *var)
{
    unsigned seen = 0;
    unsigned i;

    error->x_q4 = 0;
    error->y_q4 = 0;
    error->heading = 0;
    *var = 0;
    for (i = 0; i < 2; i++) {
        int32_t x_q4;
        int32_t y_q4;

        if (!edge[i].valid)
            continue;
        to_field(then, &edge[i], &x_q4, &y_q4);
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

static int inside_pitch(int32_t x_q4, int32_t y_q4)
{
    return x_q4 < (PITCH_HALF_LENGTH_MM + IN_PITCH_SLACK_MM) * 16 &&
           x_q4 > -(PITCH_HALF_LENGTH_MM + IN_PITCH_SLACK_MM) * 16 &&
           y_q4 < (PITCH_HALF_WIDTH_MM + IN_PITCH_SLACK_MM) * 16 &&
           y_q4 > -(PITCH_HALF_WIDTH_MM + IN_PITCH_SLACK_MM) * 16;
}

/* How far off a single post may be: the nearer it is, the better its place is known. */
static int32_t single_gate_mm(const place_t edge[2])
{
    const place_t *post = edge[0].valid ? &edge[0] : &edge[1];

    return clamp(SINGLE_GATE_NEAR_MM + GATE_SIGMAS * (int32_t)post->sigma_mm, 0, SINGLE_GATE_MM);
}

/* A whole goal was seen where none should be: be less sure of the own place. */
static void doubt_place(world_t *world)
{
    world->position_var += (int32_t)DOUBT_MM * DOUBT_MM;
    world->heading_var = clamp(world->heading_var + DOUBT_HEADING_VAR, 0, HEADING_VAR_MAX);
    if (++world->position_doubts >= DOUBTS_MAX) {
        world->position_doubts = 0;
        world->position_var = (int32_t)LOST_SIGMA_MM * LOST_SIGMA_MM;
    }
}

/* Which goal is seen: 1 the opponent's, -1 the own, 0 cannot be told. */
static int goal_side(const pose_t *then, const place_t edge[2])
{
    const place_t *any = edge[0].valid ? &edge[0] : &edge[1];
    int32_t cosine =
        angle_cos_q14(angle_wrap(then->heading + angle_of(any->forward_mm, any->left_mm)));

    if (cosine > SIDE_COS_MIN_Q14)
        return 1;
    return cosine < -SIDE_COS_MIN_Q14 ? -1 : 0;
}

static void see_goal(world_t *world, const place_t edge[2], const pose_t *then)
{
    pose_t pose = *then;
    pose_t error;
    pose_t change;
    int32_t var;
    int32_t total;
    int32_t off_mm;
    int32_t gate_mm;
    int32_t gain_q8;
    unsigned seen;
    int side;

    if (!edge[0].valid && !edge[1].valid)
        return;
    side = goal_side(then, edge);
    if (side == 0)
        return;
    change.x_q4 = 0;
    change.y_q4 = 0;
    change.heading = 0;
    if (edge[0].valid && edge[1].valid)
        change.heading = heading_change(world, then, edge, side);
    pose.heading = angle_wrap(pose.heading + change.heading);
    seen = position_error(&pose, edge, side, &error, &var);
    if (!inside_pitch(pose.x_q4 + error.x_q4, pose.y_q4 + error.y_q4))
        return;

    var = var * SYSTEMATIC_FACTOR * (seen == 1 ? SINGLE_FACTOR : 1) + POSITION_VAR_FLOOR;
    total = world->position_var + var;
    off_mm = (int32_t)length_of(error.x_q4, error.y_q4) / 16;
    gate_mm = GATE_SIGMAS * (int32_t)square_root((uint32_t)total) + GATE_SLACK_MM;
    if (seen == 1 && world->localised)
        gate_mm = clamp(gate_mm, 0, single_gate_mm(edge));
    if (off_mm > gate_mm) {
        /* Once is an error of the eye; again and again it is one of ours: wheels slipped. */
        if (seen == 2)
            doubt_place(world);
        return;
    }
    world->position_doubts = 0;
    gain_q8 = 256 * world->position_var / total;
    change.x_q4 = error.x_q4 * gain_q8 / 256;
    change.y_q4 = error.y_q4 * gain_q8 / 256;
    world->position_var -= world->position_var * gain_q8 / 256;
    world->goal_age_ticks = 0;
    if (world->position_var < (int32_t)LOCALISED_SIGMA_MM * LOCALISED_SIGMA_MM)
        world->localised = 1;
    correct(world, then, &change);
}

static void place_object(object_t *object, int32_t x_q4, int32_t y_q4)
{
    object->known = 1;
    object->doubts = 0;
    object->x_q4 = x_q4;
    object->y_q4 = y_q4;
    object->vx_mm_s = 0;
    object->vy_mm_s = 0;
}

/* An alpha-beta filter on the ball: near, a sighting is exact and trusted; far, it is noisy. */
static void see_ball(world_t *world, const place_t *place, const pose_t *then, uint32_t age_100us)
{
    object_t *ball = &world->ball;
    int32_t x_q4;
    int32_t y_q4;
    int32_t off_x;
    int32_t off_y;
    int32_t alpha_q8;
    int32_t beta_q8;
    int32_t since_ticks;

    to_field(then, place, &x_q4, &y_q4);
    if (world->localised && !inside_pitch(x_q4 * 15 / 16, y_q4 * 15 / 16))
        return;
    if (!ball->known) {
        place_object(ball, x_q4, y_q4);
    } else {
        /* Compare with where the ball was believed to be at the moment of exposure. */
        off_x = x_q4 - (ball->x_q4 - ball->vx_mm_s * (int32_t)age_100us / 625);
        off_y = y_q4 - (ball->y_q4 - ball->vy_mm_s * (int32_t)age_100us / 625);
        if ((int32_t)length_of(off_x, off_y) / 16 > BALL_GATE_MM + 3 * place->sigma_mm) {
            if (++ball->doubts < BALL_DOUBTS_MAX)
                return;
            place_object(ball, x_q4, y_q4);
        } else {
            ball->doubts = 0;
            since_ticks = clamp(ball->age_ticks, 2, 20);
            alpha_q8 = 1024 / (place->sigma_mm + 7);
            beta_q8 = alpha_q8 * alpha_q8 / 512;
            ball->x_q4 += off_x * alpha_q8 / 256;
            ball->y_q4 += off_y * alpha_q8 / 256;
            /* q4 a tick to mm/s: 100 / 16. */
            ball->vx_mm_s += off_x * beta_q8 / 256 * 25 / (4 * since_ticks);
            ball->vy_mm_s += off_y * beta_q8 / 256 * 25 / (4 * since_ticks);
            ball->vx_mm_s = clamp(ball->vx_mm_s, -BALL_SPEED_MAX_MM_S, BALL_SPEED_MAX_MM_S);
            ball->vy_mm_s = clamp(ball->vy_mm_s, -BALL_SPEED_MAX_MM_S, BALL_SPEED_MAX_MM_S);
        }
    }
    ball->age_ticks = 0;
    ball->unseen_ticks = 0;
    ball->rolls = length_of(ball->vx_mm_s, ball->vy_mm_s) > ROLLS_MM_S;
}

static void see_opponent(world_t *world, const place_t *place, const pose_t *then)
{
    object_t *opponent = &world->opponent;
    int32_t x_q4;
    int32_t y_q4;

    to_field(then, place, &x_q4, &y_q4);
    if (world->localised && !inside_pitch(x_q4, y_q4))
        return;
    if (!opponent->known || (int32_t)length_of(x_q4 - opponent->x_q4, y_q4 - opponent->y_q4) / 16 >
                                BALL_GATE_MM + 3 * place->sigma_mm) {
        if (opponent->known && ++opponent->doubts < BALL_DOUBTS_MAX)
            return;
        place_object(opponent, x_q4, y_q4);
    } else {
        opponent->doubts = 0;
        opponent->x_q4 += (x_q4 - opponent->x_q4) / 4;
        opponent->y_q4 += (y_q4 - opponent->y_q4) / 4;
    }
    opponent->age_ticks = 0;
    opponent->unseen_ticks = 0;
}

void world_see(world_t *world, const sightings_t *sightings, uint32_t age_100us)
{
    pose_t then;
    pose_t now;

    pose_then(world, age_100us, &then);
    see_goal(world, sightings->goal_edge, &then);
    /* The correction may have moved history. */
    pose_then(world, age_100us, &then);
    if (sightings->ball.valid)
        see_ball(world, &sightings->ball, &then, age_100us);
    else if (sightings->ball_near && world->ball.known)
        world->ball.unseen_ticks = 0;
    if (sightings->opponent.valid)
        see_opponent(world, &sightings->opponent, &then);
    if (world->ball.known && world->ball.age_ticks == 0) {
        odometry_pose(&world->odometry, &now);
        world->last_ball_bearing =
            angle_of(world->ball.x_q4 - now.x_q4, world->ball.y_q4 - now.y_q4);
    }
}
