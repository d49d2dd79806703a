#include "soccer/world.h"

#include "vision/camera.h"

#define START_X_MM            (-262)
#define LOST_SIGMA_MM         300
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
#define DOUBTS_MAX            5
#define DOUBT_MM              60                /* what one of them adds, */
#define DOUBT_HEADING_VAR     (728L * 728 / 16) /* ... to the heading 4 degrees */
/* A robot that is shoved or whose wheels slip moves otherwise than they say; while the opponent
 * touches it each LOOK_TICKS, and when it finds itself stuck. */
#define SHOVED_MM             95
#define SHOVED_VAR            100
#define SHOVED_HEADING_VAR    (364L * 364 / 16)
#define SLIPPED_VAR           1600
#define SLIPPED_HEADING_VAR   (910L * 910 / 16)
/* A single post may be anything upright and dark: it counts less, and once the place is known only
 * near to where it must be. */
#define SINGLE_FACTOR         4
#define SINGLE_GATE_MM        90
#define SINGLE_GATE_NEAR_MM   35
/* Which goal is it? Not asked when looking along the goal lines, beyond 65 degrees. */
#define SIDE_COS_MIN_Q14      6900

#define SPEED_MAX_MM_S       1000
/* From sightings farther apart no speed is taken. */
#define SPEED_TICKS_MAX      10
/* Of an object's place as seen from the robot: the least, and where nothing is known any more. */
#define SIGMA_MIN_Q4         32
#define SIGMA_MAX_Q4         (400 * 16)
/* Across the line of sight: 2 mm, and half a pixel. */
#define ACROSS_SIGMA_MM      2
#define ACROSS_DIVISOR       640
#define ROLLS_MM_S           100u /* below, the speed is mostly noise */
#define WALL_SLACK_MM        15
/* Nearer than that, middle to middle, two robots overlap; only asked of a fresh sighting. */
#define OVERLAP_MM           50
#define OPPONENT_FRESH_TICKS 300
#define CONTACT_MM           (BALL_RADIUS + ROBOT_RADIUS)
/* Where an object must be to be expected in view. */
#define VIEW_NEAR_MM         220 /* of the opponent: nearer, he is beyond the search range */
/* So long not seen, and so near to the opponent: he has it and takes it along. */
#define GO_ON_TICKS          50
#define CARRIED_AGE_TICKS    8
#define CARRIED_MM           110
/* A ball that fills the eye is looked for nowhere else unless it was seen there so lately. */
#define NEAR_AGE_TICKS       15
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

typedef struct {
    int32_t cosine_q14;
    int32_t sine_q14;
} rotation_t;

static void rotation_by(angle_t angle, rotation_t *rotation)
{
    rotation->cosine_q14 = angle_cos_q14(angle);
    rotation->sine_q14 = angle_sin_q14(angle);
}

/* |x|, |y| <= 60000, 3.7 m in 1/16 mm: everything on the pitch, seen from a belief about the robot
 * that odometry keeps within 2 m. */
static void rotate(const rotation_t *by, int32_t x, int32_t y, int32_t *to_x, int32_t *to_y)
{
    *to_x = (x * by->cosine_q14 - y * by->sine_q14) >> 14;
    *to_y = (x * by->sine_q14 + y * by->cosine_q14) >> 14;
}

/* ---- Start ---- */

static void forget(object_t *object)
{
    static const object_t nothing;

    *object = nothing;
    object->age_ticks = UINT16_MAX;
    object->sigma_q4 = SIGMA_MAX_Q4;
}

void world_start(world_t *world, const soccer_tuning_t *tuning, angle_t heading)
{
    pose_t pose;
    unsigned i;

    world->tuning = tuning;
    pose.x_q4 = START_X_MM * 16;
    pose.y_q4 = 0;
    pose.heading = heading;
    odometry_set(&world->odometry, &pose);
    for (i = 0; i < WORLD_HISTORY; i++)
        world->history[i] = pose;
    world->newest = 0;
    world->position_var = (int32_t)tuning->kick_off_sigma_mm * tuning->kick_off_sigma_mm;
    world->heading_var = HEADING_VAR_START;
    world->travel_rest = 0;
    world->spin_rest = 0;
    world->position_doubts = 0;
    world->wall_ticks = 0;
    world->localised = 0;
    world->last_ball_bearing = heading;
    world->goal_age_ticks = UINT16_MAX;
    world->ball_near_ticks = UINT16_MAX;
    forget(&world->ball);
    forget(&world->opponent);
}

uint16_t world_position_sigma_mm(const world_t *world)
{
    return (uint16_t)square_root((uint32_t)world->position_var);
}

/* ---- Time passes ---- */

static void add_uncertainty(world_t *world, int32_t position_var, int32_t heading_var)
{
    world->position_var =
        clamp(world->position_var + position_var, 0, (int32_t)LOST_SIGMA_MM * LOST_SIGMA_MM);
    world->heading_var = clamp(world->heading_var + heading_var, 0, HEADING_VAR_MAX);
}

void world_slipped(world_t *world)
{
    add_uncertainty(world, SLIPPED_VAR, SLIPPED_HEADING_VAR);
}

/* The opponent, where he touches the robot, may shove it. */
static void be_shoved(world_t *world, const pose_t *pose)
{
    const object_t *opponent = &world->opponent;

    if (opponent->known && opponent->age_ticks < OPPONENT_FRESH_TICKS &&
        length_of(opponent->x_q4 - pose->x_q4, opponent->y_q4 - pose->y_q4) < SHOVED_MM * 16)
        add_uncertainty(world, SHOVED_VAR, SHOVED_HEADING_VAR);
}

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

static int32_t slower(int32_t speed_mm_s, int32_t loss_mm_s)
{
    if (speed_mm_s > loss_mm_s)
        return speed_mm_s - loss_mm_s;
    return speed_mm_s < -loss_mm_s ? speed_mm_s + loss_mm_s : 0;
}

/* On with its speed, no farther than its middle can be. */
static void move_on(object_t *object, int32_t radius_mm)
{
    int in_mouth =
        object->y_q4 < GOAL_HALF_WIDTH_MM * 16 && object->y_q4 > -GOAL_HALF_WIDTH_MM * 16;
    int32_t limit_x = (PITCH_HALF_LENGTH_MM + (in_mouth ? GOAL_DEPTH_MM : 0) - radius_mm + 10) * 16;
    int32_t limit_y = (PITCH_HALF_WIDTH_MM - radius_mm + 10) * 16;

    /* mm/s * 10 ms * 16 = 41/256 of a q4 step. */
    object->x_q4 = clamp(object->x_q4 + ((object->vx_mm_s * 41) >> 8), -limit_x, limit_x);
    object->y_q4 = clamp(object->y_q4 + ((object->vy_mm_s * 41) >> 8), -limit_y, limit_y);
}

/* An opponent goes on as he was seen to, but who knows for how long. */
static void go_on(object_t *opponent)
{
    if (opponent->age_ticks > GO_ON_TICKS) {
        opponent->vx_mm_s = 0;
        opponent->vy_mm_s = 0;
    } else if (opponent->vx_mm_s != 0 || opponent->vy_mm_s != 0) {
        move_on(opponent, ROBOT_RADIUS);
    }
}

/* The ball rolls on, stays on the pitch, and is not where the robot is. */
static void roll(world_t *world, const pose_t *pose)
{
    object_t *ball = &world->ball;
    int32_t dx;
    int32_t dy;
    int32_t distance;

    if (ball->vx_mm_s != 0 || ball->vy_mm_s != 0)
        move_on(ball, BALL_RADIUS);
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

static int in_view(const object_t *object, const pose_t *pose, int32_t near_mm)
{
    int32_t dx = object->x_q4 - pose->x_q4;
    int32_t dy = object->y_q4 - pose->y_q4;
    int32_t distance_mm = (int32_t)length_of(dx, dy) / 16;
    angle_t bearing = angle_wrap(angle_of(dx, dy) - pose->heading);

    return distance_mm > near_mm && distance_mm < VIEW_FAR_MM && bearing < VIEW_HALF_ANGLE &&
           bearing > -VIEW_HALF_ANGLE;
}

/* `look`: once in LOOK_TICKS, for what need not be done each tick. */
static void grow_old(object_t *object, const pose_t *pose, int32_t drift_mm_s, int32_t near_mm,
                     int look)
{
    if (!object->known)
        return;
    count_up(&object->age_ticks);
    if (!look)
        return;
    object->sigma_q4 += drift_mm_s * (int32_t)LOOK_TICKS * 4 / 25;
    if (object->sigma_q4 > SIGMA_MAX_Q4)
        object->sigma_q4 = SIGMA_MAX_Q4;
    if (object->unseen_ticks < UINT16_MAX - LOOK_TICKS && in_view(object, pose, near_mm))
        object->unseen_ticks = (uint16_t)(object->unseen_ticks + LOOK_TICKS);
}

/* A ball that vanished at the opponent goes where he goes. */
static void be_carried(world_t *world)
{
    const object_t *opponent = &world->opponent;
    object_t *ball = &world->ball;

    if (ball->age_ticks < CARRIED_AGE_TICKS || !opponent->known ||
        opponent->age_ticks > ball->age_ticks ||
        length_of(ball->x_q4 - opponent->x_q4, ball->y_q4 - opponent->y_q4) > CARRIED_MM * 16)
        return;
    ball->vx_mm_s = opponent->vx_mm_s;
    ball->vy_mm_s = opponent->vy_mm_s;
}

static void lose_speed(const world_t *world, object_t *ball)
{
    int32_t loss_mm_s = world->tuning->ball_slowing_mm_s2 * (int32_t)LOOK_TICKS / 100;

    ball->vx_mm_s = slower(ball->vx_mm_s, loss_mm_s);
    ball->vy_mm_s = slower(ball->vy_mm_s, loss_mm_s);
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
    grow_old(&world->ball, &pose, world->tuning->ball_drift_mm_s, 0, look);
    count_up(&world->ball_near_ticks);
    grow_old(&world->opponent, &pose, world->tuning->opponent_drift_mm_s, VIEW_NEAR_MM, look);
    if (look)
        be_shoved(world, &pose);
    if (world->opponent.known)
        go_on(&world->opponent);
    if (!world->ball.known)
        return;
    roll(world, &pose);
    if (look) {
        lose_speed(world, &world->ball);
        be_carried(world);
    }
}

/* ---- Sightings ---- */

/* The pose `age_100us` ago, between two ticks interpolated. */
static void pose_then(const world_t *world, uint32_t age_100us, pose_t *pose)
{
    uint32_t back = age_100us / WORLD_TICK_100US;
    int32_t part_q8 = (int32_t)(age_100us % WORLD_TICK_100US) * 655 >> 8;
    const pose_t *after;
    const pose_t *before;

    if (back > WORLD_HISTORY - 2) {
        back = WORLD_HISTORY - 2;
        part_q8 = 256;
    }
    after = &world->history[(world->newest + WORLD_HISTORY - back) % WORLD_HISTORY];
    before = &world->history[(world->newest + WORLD_HISTORY - back - 1) % WORLD_HISTORY];
    pose->x_q4 = after->x_q4 + ((before->x_q4 - after->x_q4) * part_q8 >> 8);
    pose->y_q4 = after->y_q4 + ((before->y_q4 - after->y_q4) * part_q8 >> 8);
    pose->heading =
        angle_wrap(after->heading + (angle_wrap(before->heading - after->heading) * part_q8 >> 8));
}

static void to_field(const pose_t *pose, const place_t *place, int32_t *x_q4, int32_t *y_q4)
{
    rotation_t rotation;

    rotation_by(pose->heading, &rotation);
    rotate(&rotation, place->forward_mm * 16, place->left_mm * 16, x_q4, y_q4);
    *x_q4 += pose->x_q4;
    *y_q4 += pose->y_q4;
}

/* Turn and shift one thing along with the robot: what was seen relative to it stays so. */
static void carry(int32_t *x_q4, int32_t *y_q4, const pose_t *pivot, const pose_t *change,
                  const rotation_t *rotation)
{
    int32_t x;
    int32_t y;

    rotate(rotation, *x_q4 - pivot->x_q4, *y_q4 - pivot->y_q4, &x, &y);
    *x_q4 = pivot->x_q4 + change->x_q4 + x;
    *y_q4 = pivot->y_q4 + change->y_q4 + y;
}

/* Correct the belief by `change`, seen from where the robot was: `pivot`. */
static void correct(world_t *world, const pose_t *pivot, const pose_t *change)
{
    rotation_t rotation;
    pose_t now;
    unsigned i;

    rotation_by(change->heading, &rotation);
    for (i = 0; i < WORLD_HISTORY; i++) {
        pose_t *pose = &world->history[i];

        carry(&pose->x_q4, &pose->y_q4, pivot, change, &rotation);
        pose->heading = angle_wrap(pose->heading + change->heading);
    }
    if (world->ball.known)
        carry(&world->ball.x_q4, &world->ball.y_q4, pivot, change, &rotation);
    if (world->opponent.known)
        carry(&world->opponent.x_q4, &world->opponent.y_q4, pivot, change, &rotation);
    odometry_pose(&world->odometry, &now);
    carry(&now.x_q4, &now.y_q4, pivot, change, &rotation);
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

static int inside_pitch(const world_t *world, int32_t x_q4, int32_t y_q4)
{
    int32_t slack_mm = world->tuning->wall_slack_mm;

    return x_q4 < (PITCH_HALF_LENGTH_MM + slack_mm) * 16 &&
           x_q4 > -(PITCH_HALF_LENGTH_MM + slack_mm) * 16 &&
           y_q4 < (PITCH_HALF_WIDTH_MM + slack_mm) * 16 &&
           y_q4 > -(PITCH_HALF_WIDTH_MM + slack_mm) * 16;
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

/* Returns whether the belief was corrected. */
static int see_goal(world_t *world, const place_t edge[2], const pose_t *then)
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
        return 0;
    side = goal_side(then, edge);
    if (side == 0)
        return 0;
    change.x_q4 = 0;
    change.y_q4 = 0;
    change.heading = 0;
    if (edge[0].valid && edge[1].valid)
        change.heading = heading_change(world, then, edge, side);
    pose.heading = angle_wrap(pose.heading + change.heading);
    seen = position_error(&pose, edge, side, &error, &var);
    if (!inside_pitch(world, pose.x_q4 + error.x_q4, pose.y_q4 + error.y_q4))
        return 0;

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
        return 0;
    }
    world->position_doubts = 0;
    gain_q8 = 256 * world->position_var / total;
    change.x_q4 = error.x_q4 * gain_q8 / 256;
    change.y_q4 = error.y_q4 * gain_q8 / 256;
    world->position_var -= world->position_var * gain_q8 / 256;
    world->goal_age_ticks = 0;
    if (world->position_var <
        (int32_t)world->tuning->localised_sigma_mm * world->tuning->localised_sigma_mm)
        world->localised = 1;
    correct(world, then, &change);
    return 1;
}

/* ---- Ball and opponent ---- */

static void place_object(object_t *object, int32_t x_q4, int32_t y_q4, const place_t *place)
{
    object->known = 1;
    object->doubts = 0;
    object->x_q4 = x_q4;
    object->y_q4 = y_q4;
    object->vx_mm_s = 0;
    object->vy_mm_s = 0;
    object->sigma_q4 = place->sigma_mm * 16 + SIGMA_MIN_Q4;
}

/* Share of an innovation that is believed: var / (var + var of the sighting). */
static int32_t share_q8(int32_t sigma_q4, int32_t seen_sigma_mm)
{
    /* In 1/4 mm, so that 256 squares fit 32 bits. */
    int32_t var = (sigma_q4 / 4) * (sigma_q4 / 4);
    int32_t seen_var = seen_sigma_mm * seen_sigma_mm * 16;

    return 256 * var / (var + seen_var + 1);
}

/* An alpha-beta filter along and across the line of sight: across it the eye is exact, along it the
 * error grows with the square of the range. `off`: sighting minus belief at the exposure, field;
 * `ray`: from the robot to the sighting. */
static void filter(object_t *object, const place_t *place, const int32_t off_q4[2],
                   const int32_t ray_q4[2], int32_t speed_gain_q8)
{
    int32_t range_q4 = (int32_t)length_of(ray_q4[0], ray_q4[1]) + 1;
    int32_t ray_x_q12 = ray_q4[0] * 4096 / range_q4;
    int32_t ray_y_q12 = ray_q4[1] * 4096 / range_q4;
    int32_t along_q4 = (off_q4[0] * ray_x_q12 + off_q4[1] * ray_y_q12) >> 12;
    int32_t across_q4 = (off_q4[1] * ray_x_q12 - off_q4[0] * ray_y_q12) >> 12;
    int32_t alpha = share_q8(object->sigma_q4, place->sigma_mm);
    int32_t alpha_across =
        share_q8(object->sigma_q4, ACROSS_SIGMA_MM + range_q4 / (16 * ACROSS_DIVISOR));
    int32_t since_ticks = clamp(object->age_ticks, 2, SPEED_TICKS_MAX);

    along_q4 = along_q4 * alpha / 256;
    across_q4 = across_q4 * alpha_across / 256;
    object->x_q4 += (along_q4 * ray_x_q12 - across_q4 * ray_y_q12) >> 12;
    object->y_q4 += (along_q4 * ray_y_q12 + across_q4 * ray_x_q12) >> 12;
    object->sigma_q4 =
        clamp(object->sigma_q4 * (int32_t)square_root((uint32_t)(256 - alpha) * 256) / 256,
              SIGMA_MIN_Q4, SIGMA_MAX_Q4);
    if (object->age_ticks > SPEED_TICKS_MAX) {
        object->vx_mm_s = 0;
        object->vy_mm_s = 0;
        return;
    }
    /* A small share of what alpha left: a ball at rest must not seem to roll. q4 a tick to mm/s:
     * 100 / 16. */
    along_q4 = along_q4 * speed_gain_q8 / 256 * 25 / (4 * since_ticks);
    across_q4 = across_q4 * speed_gain_q8 / 256 * 25 / (4 * since_ticks);
    object->vx_mm_s =
        clamp(object->vx_mm_s + ((along_q4 * ray_x_q12 - across_q4 * ray_y_q12) >> 12),
              -SPEED_MAX_MM_S, SPEED_MAX_MM_S);
    object->vy_mm_s =
        clamp(object->vy_mm_s + ((along_q4 * ray_y_q12 + across_q4 * ray_x_q12) >> 12),
              -SPEED_MAX_MM_S, SPEED_MAX_MM_S);
}

/* A sighting of ball or opponent. */
static void see_object(world_t *world, object_t *object, const place_t *place, const pose_t *then,
                       uint32_t age_100us, int32_t gate_mm)
{
    int32_t x_q4;
    int32_t y_q4;
    int32_t off_q4[2];
    int32_t ray_q4[2];

    to_field(then, place, &x_q4, &y_q4);
    if (world->localised && !inside_pitch(world, x_q4, y_q4))
        return;
    /* Compare with where it was believed to be at the moment of exposure: v * age / 625. */
    off_q4[0] = x_q4 - object->x_q4 + (object->vx_mm_s * (int32_t)age_100us * 105 >> 16);
    off_q4[1] = y_q4 - object->y_q4 + (object->vy_mm_s * (int32_t)age_100us * 105 >> 16);
    ray_q4[0] = x_q4 - then->x_q4;
    ray_q4[1] = y_q4 - then->y_q4;
    if (!object->known) {
        place_object(object, x_q4, y_q4, place);
    } else if ((int32_t)length_of(off_q4[0], off_q4[1]) / 16 >
               gate_mm + 3 * (place->sigma_mm + object->sigma_q4 / 16)) {
        if (++object->doubts < world->tuning->doubts_max)
            return;
        place_object(object, x_q4, y_q4, place);
    } else {
        object->doubts = 0;
        filter(object, place, off_q4, ray_q4, world->tuning->speed_gain_q8);
    }
    object->age_ticks = 0;
    object->unseen_ticks = 0;
}

static void see_ball(world_t *world, const place_t *place, const pose_t *then, uint32_t age_100us)
{
    object_t *ball = &world->ball;
    pose_t now;

    see_object(world, ball, place, then, age_100us, world->tuning->ball_gate_mm);
    if (!ball->known || ball->age_ticks != 0)
        return;
    ball->rolls = length_of(ball->vx_mm_s, ball->vy_mm_s) > ROLLS_MM_S;
    odometry_pose(&world->odometry, &now);
    world->last_ball_bearing = angle_of(ball->x_q4 - now.x_q4, ball->y_q4 - now.y_q4);
}

/* It fills the eye. Its place is a guess, only taken if there is no better one; age tells. */
static void see_near_ball(world_t *world, const place_t *guess, const pose_t *then)
{
    object_t *ball = &world->ball;
    int32_t x_q4;
    int32_t y_q4;

    world->ball_near_ticks = 0;
    ball->unseen_ticks = 0;
    if (ball->known && ball->age_ticks <= NEAR_AGE_TICKS)
        return;
    to_field(then, guess, &x_q4, &y_q4);
    place_object(ball, x_q4, y_q4, guess);
    ball->age_ticks = NEAR_AGE_TICKS + 1;
}

void world_see(world_t *world, const sightings_t *sightings, uint32_t age_100us)
{
    pose_t then;

    pose_then(world, age_100us, &then);
    if (see_goal(world, sightings->goal_edge, &then))
        /* The correction has moved history. */
        pose_then(world, age_100us, &then);
    if (sightings->ball.valid)
        see_ball(world, &sightings->ball, &then, age_100us);
    else if (sightings->ball_near)
        see_near_ball(world, &sightings->ball, &then);
    if (sightings->opponent.valid)
        see_object(world, &world->opponent, &sightings->opponent, &then, age_100us,
                   world->tuning->opponent_gate_mm);
}

/* ---- What others want to know ---- */

/* 65536 / (2 pi) / 16: an angle for a distance across, in 1/16 mm, at a range in mm. */
#define ANGLE_OF_ACROSS 652

static void sight_of(const pose_t *pose, int32_t x_q4, int32_t y_q4, int32_t sigma_q4,
                     sight_t *sight)
{
    int32_t dx = x_q4 - pose->x_q4;
    int32_t dy = y_q4 - pose->y_q4;
    int32_t range_mm = (int32_t)length_of(dx, dy) / 16;

    sight->range_mm = (uint16_t)range_mm;
    sight->bearing = angle_wrap(angle_of(dx, dy) - pose->heading);
    sight->range_sigma_mm = (uint16_t)(sigma_q4 / 16);
    sight->bearing_sigma =
        (uint16_t)clamp(sigma_q4 * ANGLE_OF_ACROSS / (range_mm + 1), 0, ANGLE_90);
}

int world_sight(const world_t *world, const object_t *object, sight_t *sight)
{
    pose_t pose;

    if (!object->known)
        return 0;
    odometry_pose(&world->odometry, &pose);
    sight_of(&pose, object->x_q4, object->y_q4, object->sigma_q4, sight);
    return 1;
}

int world_sight_goal(const world_t *world, int side, sight_t *sight)
{
    int32_t heading_sigma = 4 * (int32_t)square_root((uint32_t)world->heading_var);
    pose_t pose;

    if (!world->localised)
        return 0;
    odometry_pose(&world->odometry, &pose);
    sight_of(&pose, side * PITCH_HALF_LENGTH_MM * 16, 0,
             16 * (int32_t)square_root((uint32_t)world->position_var), sight);
    sight->bearing_sigma = (uint16_t)clamp(sight->bearing_sigma + heading_sigma, 0, ANGLE_90);
    return 1;
}
