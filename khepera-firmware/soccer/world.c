#include "soccer/world.h"

#include "soccer/pitch.h"
#include "soccer/plane.h"

#define START_X_MM          (-262)
/* A robot that is shoved or whose wheels slip moves otherwise than they say; while the opponent
 * touches it each LOOK_TICKS, and when it finds itself stuck. */
#define SHOVED_MM           95
#define SHOVED_VAR          100
#define SHOVED_HEADING_VAR  (364L * 364 / 16)
#define SLIPPED_VAR         1600
#define SLIPPED_HEADING_VAR (910L * 910 / 16)

#define SMALL_TURN           ANGLE_DEGREES(2)
#define SPEED_MAX_MM_S       1000
/* From sightings farther apart no speed is taken. */
#define SPEED_TICKS_MAX      10
/* Of an object's place as seen from the robot: the least, and where nothing is known any more. */
#define SIGMA_MIN_Q4         32
#define SIGMA_MAX_Q4         (400 * 16)
/* Across the line of sight: 2 mm, half a pixel, and a part of what the range is off by. */
#define ACROSS_SIGMA_MM      2
#define ACROSS_DIVISOR       640
#define ACROSS_SHARE         4
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
/* The foot of a wall nearer than 162 mm is below the picture, and a little more; so are those of
 * the outer columns. A robot so near covers most of the picture. */
#define BLIND_WALL_MM        190
#define BLIND_ASIDE          ANGLE_DEGREES(20)
#define BLIND_ROBOT_MM       150
#define VIEW_FAR_MM          900
#define VIEW_HALF_ANGLE      ANGLE_DEGREES(19)
/* Whether it should be in view is asked only so often: it costs a square root and an angle. */
#define LOOK_TICKS           4u

static void count_up(uint16_t *ticks)
{
    if (*ticks < UINT16_MAX)
        (*ticks)++;
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
    own_place_start(&world->own, tuning);
    world->wall_ticks = 0;
    world->last_ball_bearing = heading;
    forget(&world->ball);
    forget(&world->opponent);
}

uint16_t world_position_sigma_mm(const world_t *world)
{
    const int32_t *var = world->own.position_var;

    return (uint16_t)square_root((uint32_t)var[var[1] > var[0]]);
}

/* ---- Time passes ---- */

void world_slipped(world_t *world)
{
    own_place_blur(&world->own, SLIPPED_VAR, SLIPPED_HEADING_VAR);
}

/* The opponent, where he touches the robot, may shove it. */
static void be_shoved(world_t *world, const pose_t *pose)
{
    const object_t *opponent = &world->opponent;

    if (opponent->known && opponent->age_ticks < OPPONENT_FRESH_TICKS &&
        is_within(opponent->x_q4 - pose->x_q4, opponent->y_q4 - pose->y_q4, SHOVED_MM * 16))
        own_place_blur(&world->own, SHOVED_VAR, SHOVED_HEADING_VAR);
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
    object->x_q4 = plane_clamp(object->x_q4 + ((object->vx_mm_s * 41) >> 8), -limit_x, limit_x);
    object->y_q4 = plane_clamp(object->y_q4 + ((object->vy_mm_s * 41) >> 8), -limit_y, limit_y);
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
        !is_within(ball->x_q4 - opponent->x_q4, ball->y_q4 - opponent->y_q4, CARRIED_MM * 16 + 1))
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
           is_within(dx, dy, OVERLAP_MM * 16);
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
    int32_t x = plane_clamp(world->odometry.x_q16, -limit_x, limit_x);
    int32_t y = plane_clamp(world->odometry.y_q16, -limit_y, limit_y);
    int held = x != world->odometry.x_q16 || y != world->odometry.y_q16;

    if (!world->own.localised)
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
    own_place_travel(&world->own, counts);
    look = world->newest % LOOK_TICKS == 0;
    grow_old(&world->ball, &pose, world->tuning->ball_drift_mm_s, 0, look);
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
    int small = change->heading < SMALL_TURN && change->heading > -SMALL_TURN;
    rotation_t rotation;
    pose_t now;
    unsigned i;

    rotation_by(change->heading, &rotation);
    for (i = 0; i < WORLD_HISTORY; i++) {
        pose_t *pose = &world->history[i];

        /* Within the history's time the robot does not get far: a small turn hardly moves it. */
        if (small) {
            pose->x_q4 += change->x_q4;
            pose->y_q4 += change->y_q4;
        } else {
            carry(&pose->x_q4, &pose->y_q4, pivot, change, &rotation);
        }
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
        share_q8(object->sigma_q4, ACROSS_SIGMA_MM + place->sigma_mm / ACROSS_SHARE +
                                       range_q4 / (16 * ACROSS_DIVISOR));
    int32_t since_ticks = plane_clamp(object->age_ticks, 2, SPEED_TICKS_MAX);

    along_q4 = along_q4 * alpha / 256;
    across_q4 = across_q4 * alpha_across / 256;
    object->x_q4 += (along_q4 * ray_x_q12 - across_q4 * ray_y_q12) >> 12;
    object->y_q4 += (along_q4 * ray_y_q12 + across_q4 * ray_x_q12) >> 12;
    object->sigma_q4 =
        plane_clamp(object->sigma_q4 * (int32_t)square_root((uint32_t)(256 - alpha) * 256) / 256,
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
        plane_clamp(object->vx_mm_s + ((along_q4 * ray_x_q12 - across_q4 * ray_y_q12) >> 12),
                    -SPEED_MAX_MM_S, SPEED_MAX_MM_S);
    object->vy_mm_s =
        plane_clamp(object->vy_mm_s + ((along_q4 * ray_y_q12 + across_q4 * ray_x_q12) >> 12),
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
    rotation_t turn;

    rotation_by(then->heading, &turn);
    place_in_field(then, &turn, place, &x_q4, &y_q4);
    if (world->own.localised && !pitch_contains(x_q4, y_q4, world->tuning->wall_slack_mm))
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
    ball->rolls = !is_within(ball->vx_mm_s, ball->vy_mm_s, ROLLS_MM_S + 1);
    odometry_pose(&world->odometry, &now);
    world->last_ball_bearing = angle_of(ball->x_q4 - now.x_q4, ball->y_q4 - now.y_q4);
}

/* What goals and walls tell of the own place. */
static void see_pitch(world_t *world, const sightings_t *sightings, pose_t *then,
                      uint32_t age_100us)
{
    pose_t change;

    if (own_place_see_goal(&world->own, world->tuning, sightings->goal_edge, then, &change)) {
        correct(world, then, &change);
        /* That has moved history. */
        pose_then(world, age_100us, then);
    }
    if (own_place_see_walls(&world->own, world->tuning, sightings->wall, then, &change)) {
        correct(world, then, &change);
        pose_then(world, age_100us, then);
    }
}

void world_see(world_t *world, const sightings_t *sightings, uint32_t age_100us)
{
    pose_t then;

    pose_then(world, age_100us, &then);
    see_pitch(world, sightings, &then, age_100us);
    if (sightings->ball.valid)
        see_ball(world, &sightings->ball, &then, age_100us);
    if (sightings->opponent.valid)
        see_object(world, &world->opponent, &sightings->opponent, &then, age_100us,
                   world->tuning->opponent_gate_mm);
}

/* ---- What others want to know ---- */

/* Is the wall nearer than BLIND_WALL_MM in that direction? */
static int wall_is_near(const pose_t *pose, angle_t direction)
{
    int32_t cosine = angle_cos_q14(direction);
    int32_t sine = angle_sin_q14(direction);
    int32_t reach_x_q4 = pose->x_q4 + BLIND_WALL_MM * cosine / 1024;
    int32_t reach_y_q4 = pose->y_q4 + BLIND_WALL_MM * sine / 1024;

    return !pitch_contains(reach_x_q4, reach_y_q4, 0);
}

int world_view_is_blocked(const world_t *world)
{
    const object_t *opponent = &world->opponent;
    pose_t pose;

    odometry_pose(&world->odometry, &pose);
    if (opponent->known && opponent->age_ticks < OPPONENT_FRESH_TICKS &&
        in_view(opponent, &pose, 0) &&
        is_within(opponent->x_q4 - pose.x_q4, opponent->y_q4 - pose.y_q4, BLIND_ROBOT_MM * 16))
        return 1;
    return world->own.localised && wall_is_near(&pose, pose.heading) &&
           wall_is_near(&pose, angle_wrap(pose.heading + BLIND_ASIDE)) &&
           wall_is_near(&pose, angle_wrap(pose.heading - BLIND_ASIDE));
}

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
        (uint16_t)plane_clamp(sigma_q4 * ANGLE_OF_ACROSS / (range_mm + 1), 0, ANGLE_90);
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
    int32_t heading_sigma = 4 * (int32_t)square_root((uint32_t)world->own.heading_var);
    pose_t pose;

    if (!world->own.localised)
        return 0;
    odometry_pose(&world->odometry, &pose);
    sight_of(&pose, side * PITCH_HALF_LENGTH_MM * 16, 0, 16 * world_position_sigma_mm(world),
             sight);
    sight->bearing_sigma = (uint16_t)plane_clamp(sight->bearing_sigma + heading_sigma, 0, ANGLE_90);
    return 1;
}
