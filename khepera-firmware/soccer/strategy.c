#include "soccer/strategy.h"

/* Turn rate per heading error: 6/s; 6 * 26.5 mm / (65536 / 2 pi) = 1/66. */
#define TURN_GAIN_DIVISOR 66

/* Times, ticks of 10 ms. */
#define TICK_MS         10
#define WALL_TICKS      15
/* A ball seen so lately is where it is believed to be. */
#define STILL_AGE_TICKS 5

/* How much a wheel differs while the robot backs off: a curve leads away from what it hit. */
#define BACK_OFF_CURVE_MM_S 20

/* Distances, mm. */
#define RELOCATE_X_MM     (-340)
#define RELOCATE_Y_MM     170
#define RELOCATE_ASIDE_MM 180
#define BEHIND_MIN_MM     90  /* a shorter run-up will do, */
#define BEHIND_TIGHT_MM   70  /* ... and this one if nothing else is to be had */
#define FREE_X_MM         490 /* where the robot's middle may go */
#define FREE_Y_MM         305
#define FREE_IN_GOAL_MM   540 /* ... and in a goal's mouth, */
#define GOAL_MOUTH_MM     105 /* ... which is so wide on either side */
#define PASS_EXTRA_MM     20  /* an opponent is passed so much farther off than needed */
#define GOAL_INSIDE_MM    50  /* so far behind the line lies the aim */
#define GOAL_AIM_MIN_MM   70  /* ... and at least so far ahead of the ball */
#define PUSH_ALONG_MIN_MM 60
#define PUSH_ALONG_MAX_MM 260
#define THERE_MM          10
#define VIEW_THERE_MM     30
#define DEFEND_THERE_MM   25
#define OWN_GOAL_NEAR_MM  (-200) /* nearer, a shot never goes back */
#define STILL_MM          60     /* a ball that has moved no farther is still */
#define PINNED_MM         130    /* an opponent so near to a still ball pins it */
#define FREE_BALL_X_MM    262    /* the free ball's spots, in each quarter of the pitch */
#define FREE_BALL_Y_MM    170
#define FREE_BALL_MM      120 /* both robots are at least so far from it */
#define AWAIT_THERE_MM    15

/* Angles. */
#define AROUND_STEP          ANGLE_DEGREES(50)
#define AROUND_CHECK         ANGLE_DEGREES(30)
#define DIRECT_ANGLE         ANGLE_DEGREES(50)
#define FACE_ANGLE           ANGLE_DEGREES(8)
#define PUSH_AIM_MAX         ANGLE_DEGREES(30)
#define SHOT_STEP            1365 /* 7.5 degrees */
#define SHOT_STEPS           10
/* A shot must not go back by more than that: cos(107 degrees). */
#define SHOT_COS_MIN_Q14     (-4800)
/* RELOCATE leads forward by no more than that: cos(70 degrees). */
#define RELOCATE_COS_MAX_Q14 5600
/* A parameter in degrees as an angle. */
#define FROM_DEGREES(deg)    ((angle_t)((deg)*182))

/* Costs of a shot, in 1/65536 turns of detour. */
#define COST_OF_STEP 200
#define COST_BLOCKED 9000
#define COST_CHANGE  2500
#define COST_TIGHT   4000

typedef struct {
    pose_t pose;
    int32_t ball_x_q4; /* a moment ahead */
    int32_t ball_y_q4;
    int32_t distance_mm;    /* to the ball */
    angle_t ball_direction; /* field */
    angle_t off;       /* 0: exactly behind the ball; positive: to be driven around leftwards */
    int32_t along_mm;  /* behind the ball on the shot's line */
    int32_t across_mm; /* beside that line */
    int contested;     /* the opponent is about to get the ball */
} situation_t;

static int32_t clamp(int32_t value, int32_t limit)
{
    if (value > limit)
        return limit;
    return value < -limit ? -limit : value;
}

static int32_t size_of(int32_t value)
{
    return value < 0 ? -value : value;
}

static int32_t ahead_x(int32_t x_q4, angle_t direction, int32_t mm)
{
    return x_q4 + mm * angle_cos_q14(direction) / 1024;
}

static int32_t ahead_y(int32_t y_q4, angle_t direction, int32_t mm)
{
    return y_q4 + mm * angle_sin_q14(direction) / 1024;
}

static void set_wheels(strategy_t *strategy, int32_t forward_mm_s, int32_t turn_mm_s)
{
    strategy->wheels.left_mm_s = (int16_t)(forward_mm_s - turn_mm_s);
    strategy->wheels.right_mm_s = (int16_t)(forward_mm_s + turn_mm_s);
}

static int lasts(const strategy_t *strategy, int32_t ms)
{
    return strategy->state_ticks * TICK_MS > ms;
}

static void keep_event(strategy_t *strategy, strategy_state_t to, strategy_reason_t reason)
{
    strategy_event_t *event;

    if (strategy->event_count == STRATEGY_EVENTS) {
        strategy->event_first = (uint8_t)((strategy->event_first + 1u) % STRATEGY_EVENTS);
        strategy->event_count--;
        if (strategy->events_lost < UINT16_MAX)
            strategy->events_lost++;
    }
    event = &strategy->events[(strategy->event_first + strategy->event_count) % STRATEGY_EVENTS];
    event->from = strategy->state;
    event->to = to;
    event->reason = reason;
    strategy->event_count++;
}

static void enter(strategy_t *strategy, strategy_state_t state, strategy_reason_t reason)
{
    if (strategy->state == state)
        return;
    keep_event(strategy, state, reason);
    strategy->state = state;
    strategy->state_ticks = 0;
    strategy->stuck_ticks = 0;
}

/* May the robot's middle be there: on the pitch or in a goal's mouth? */
static int free_for_robot(int32_t x_q4, int32_t y_q4)
{
    int32_t limit_x = size_of(y_q4) < GOAL_MOUTH_MM * 16 ? FREE_IN_GOAL_MM : FREE_X_MM;

    return size_of(x_q4) <= limit_x * 16 && size_of(y_q4) <= FREE_Y_MM * 16;
}

/* ---- Driving ---- */

/* Drive with the heading `direction`: turns first if it is far off. */
static void drive_along(strategy_t *strategy, const pose_t *pose, angle_t direction,
                        int32_t speed_mm_s)
{
    angle_t error = angle_wrap(direction - pose->heading);
    int32_t turn = clamp(error / TURN_GAIN_DIVISOR, strategy->tuning->turn_max_mm_s);
    int32_t cosine = angle_cos_q14(error);
    /* cos^3: little way is made while the heading is far off. */
    int32_t forward = cosine <= 0 ? 0 : speed_mm_s * (cosine >> 7) / 128;

    forward = forward * (cosine >> 7) / 128 * (cosine >> 7) / 128;
    set_wheels(strategy, cosine <= 0 ? 0 : forward, turn);
}

/* If the straight way passes too near to `obstacle`, move the target to the side of it. */
static void avoid(const pose_t *pose, const object_t *obstacle, int32_t clear_mm, int32_t *x_q4,
                  int32_t *y_q4)
{
    /* In mm, so that products of two fit 32 bits. */
    int32_t way_x = (*x_q4 - pose->x_q4) / 16;
    int32_t way_y = (*y_q4 - pose->y_q4) / 16;
    int32_t dx = (obstacle->x_q4 - pose->x_q4) / 16;
    int32_t dy = (obstacle->y_q4 - pose->y_q4) / 16;
    int32_t way_mm = (int32_t)length_of(way_x, way_y);
    int32_t along_mm;
    int32_t across_mm;
    int32_t out_mm;

    if (way_mm == 0)
        return;
    along_mm = (dx * way_x + dy * way_y) / way_mm;
    across_mm = (dy * way_x - dx * way_y) / way_mm;
    if (along_mm <= 0 || along_mm > way_mm + clear_mm / 2 || size_of(across_mm) >= clear_mm)
        return;
    /* Obstacle left of the way: pass on its right, and the other way round; but not into a wall. */
    out_mm = clear_mm + PASS_EXTRA_MM;
    if (across_mm >= 0)
        out_mm = -out_mm;
    if (!free_for_robot(obstacle->x_q4 - 16 * way_y * out_mm / way_mm,
                        obstacle->y_q4 + 16 * way_x * out_mm / way_mm))
        out_mm = -out_mm;
    *x_q4 = obstacle->x_q4 - 16 * way_y * out_mm / way_mm;
    *y_q4 = obstacle->y_q4 + 16 * way_x * out_mm / way_mm;
}

static void drive_to(strategy_t *strategy, const world_t *world, const pose_t *pose, int32_t x_q4,
                     int32_t y_q4, int32_t speed_mm_s)
{
    int32_t distance_mm;

    x_q4 = clamp(x_q4, FREE_X_MM * 16);
    y_q4 = clamp(y_q4, FREE_Y_MM * 16);
    if (world->opponent.known)
        avoid(pose, &world->opponent, strategy->tuning->opponent_clear_mm, &x_q4, &y_q4);
    distance_mm = (int32_t)length_of(x_q4 - pose->x_q4, y_q4 - pose->y_q4) / 16;
    if (speed_mm_s > 40 + 3 * distance_mm)
        speed_mm_s = 40 + 3 * distance_mm;
    drive_along(strategy, pose, angle_of(x_q4 - pose->x_q4, y_q4 - pose->y_q4), speed_mm_s);
}

/* ---- The shot ---- */

/* Is the opponent near the line of a shot in direction (cosine, sine), or where the robot must be
 * for it? 0 = no, up to COST_BLOCKED * 5 / 4. */
static int32_t blocked_cost(const soccer_tuning_t *tuning, const object_t *opponent,
                            const situation_t *now, int32_t cosine, int32_t sine)
{
    int32_t dx = opponent->x_q4 - now->ball_x_q4;
    int32_t dy = opponent->y_q4 - now->ball_y_q4;
    int32_t along_mm = (dx * cosine + dy * sine) >> 18;
    int32_t across_mm = size_of((dy * cosine - dx * sine) >> 18);

    if (along_mm < -tuning->behind_mm - tuning->opponent_clear_mm ||
        across_mm >= tuning->shot_clear_mm)
        return 0;
    return COST_BLOCKED * (tuning->shot_clear_mm - across_mm) / tuning->shot_clear_mm +
           COST_BLOCKED / 4;
}

/* What a shot's direction costs by itself: how far beside the goal it goes, and how far the robot
 * has to drive around the ball for it. */
static int32_t direction_cost(const strategy_t *strategy, const situation_t *now, angle_t shot,
                              int32_t outside)
{
    const soccer_tuning_t *tuning = strategy->tuning;
    int32_t around = size_of(angle_wrap(now->ball_direction - shot));
    int32_t cost = now->contested
                       ? outside * tuning->contest_outside / 4 + around * tuning->contest_way / 16
                       : outside * tuning->shot_outside / 4 + around * tuning->shot_way / 16;

    if (strategy->shot_known && size_of(angle_wrap(shot - strategy->shot)) > ANGLE_DEGREES(10))
        cost += COST_CHANGE;
    return cost;
}

/* What walls and the opponent add. INT32_MAX: not to be had, or backwards. */
static int32_t obstacle_cost(const strategy_t *strategy, const world_t *world,
                             const situation_t *now, angle_t shot)
{
    int32_t cosine = angle_cos_q14(shot);
    int32_t sine = angle_sin_q14(shot);
    int32_t cost = 0;

    if (cosine < (now->ball_x_q4 < OWN_GOAL_NEAR_MM * 16 ? 0 : SHOT_COS_MIN_Q14) ||
        !free_for_robot(now->ball_x_q4 - BEHIND_TIGHT_MM * cosine / 1024,
                        now->ball_y_q4 - BEHIND_TIGHT_MM * sine / 1024))
        return INT32_MAX;
    if (!free_for_robot(now->ball_x_q4 - BEHIND_MIN_MM * cosine / 1024,
                        now->ball_y_q4 - BEHIND_MIN_MM * sine / 1024))
        cost += COST_TIGHT;
    if (world->opponent.known)
        cost += blocked_cost(strategy->tuning, &world->opponent, now, cosine, sine);
    return cost;
}

/* The best direction for the ball: into the goal if the robot can get behind it and nobody stands
 * in the way, else the next best. From the middle outwards, so that most directions are known to be
 * worse before walls and opponent are looked at. */
static void choose_shot(strategy_t *strategy, const world_t *world, const situation_t *now)
{
    int32_t goal_aim = strategy->tuning->goal_aim_mm * 16;
    int32_t ahead = (PITCH_HALF_LENGTH_MM + GOAL_INSIDE_MM) * 16 - now->ball_x_q4;
    int32_t goal_x = ahead > GOAL_AIM_MIN_MM * 16 ? ahead : GOAL_AIM_MIN_MM * 16;
    angle_t middle = angle_of(goal_x, -now->ball_y_q4);
    angle_t left = angle_of(goal_x, goal_aim - now->ball_y_q4);
    angle_t right = angle_of(goal_x, -goal_aim - now->ball_y_q4);
    int32_t best = INT32_MAX;
    angle_t chosen = middle;
    int step;

    for (step = 0; step <= 2 * SHOT_STEPS; step++) {
        /* 0, 1, -1, 2, -2... */
        int32_t aside = step % 2 ? (step + 1) / 2 : -step / 2;
        angle_t shot = angle_wrap(middle + aside * SHOT_STEP);
        int32_t over = angle_wrap(shot - left);
        int32_t under = angle_wrap(right - shot);
        int32_t outside = over > under ? over : under;
        int32_t cost = size_of(aside) * COST_OF_STEP;
        int32_t more;

        if (cost >= best)
            break; /* and so are all that follow */
        cost += direction_cost(strategy, now, shot, outside > 0 ? outside : 0);
        if (cost >= best)
            continue;
        more = obstacle_cost(strategy, world, now, shot);
        if (more < best - cost) {
            best = cost + more;
            chosen = shot;
        }
    }
    strategy->shot = chosen;
    strategy->shot_known = 1;
}

/* Is the opponent, seen lately, near to the ball? */
static int is_contested(const strategy_t *strategy, const world_t *world, const situation_t *now)
{
    const object_t *opponent = &world->opponent;

    return opponent->known && opponent->age_ticks * TICK_MS < strategy->tuning->opponent_fresh_ms &&
           is_within(opponent->x_q4 - now->ball_x_q4, opponent->y_q4 - now->ball_y_q4,
                     (uint32_t)strategy->tuning->contest_mm * 16);
}

static void look_around(strategy_t *strategy, const world_t *world, situation_t *now)
{
    int32_t dx;
    int32_t dy;

    odometry_pose(&world->odometry, &now->pose);
    /* 100 ms ahead: 1.6 q4 for each mm/s. */
    now->ball_x_q4 = world->ball.x_q4 + world->ball.vx_mm_s * 8 / 5;
    now->ball_y_q4 = world->ball.y_q4 + world->ball.vy_mm_s * 8 / 5;
    dx = now->ball_x_q4 - now->pose.x_q4;
    dy = now->ball_y_q4 - now->pose.y_q4;
    now->distance_mm = (int32_t)length_of(dx, dy) / 16;
    now->ball_direction = angle_of(dx, dy);
    now->contested = is_contested(strategy, world, now);
    if (!strategy->shot_known || strategy->plan_ticks * TICK_MS >= strategy->tuning->plan_ms) {
        choose_shot(strategy, world, now);
        strategy->plan_ticks = 0;
    }
    now->off = angle_wrap(now->ball_direction - strategy->shot);
    now->along_mm = now->distance_mm * angle_cos_q14(now->off) / 16384;
    now->across_mm = now->distance_mm * angle_sin_q14(now->off) / 16384;
}

/* ---- States ---- */

static void begin_turning(strategy_t *strategy, const world_t *world, angle_t towards)
{
    pose_t pose;

    odometry_pose(&world->odometry, &pose);
    strategy->turn = angle_wrap(towards - pose.heading) >= 0 ? 1 : -1;
}

/* A place to the side of the line to the opponent, if it is free and does not lead forward. */
static int view_from_aside(strategy_t *strategy, const world_t *world, const pose_t *pose, int side)
{
    angle_t line = angle_of(world->opponent.x_q4 - pose->x_q4, world->opponent.y_q4 - pose->y_q4);
    angle_t aside = angle_wrap(line + side * ANGLE_90);

    strategy->view_x_q4 = ahead_x(pose->x_q4, aside, RELOCATE_ASIDE_MM);
    strategy->view_y_q4 = ahead_y(pose->y_q4, aside, RELOCATE_ASIDE_MM);
    return angle_cos_q14(aside) < RELOCATE_COS_MAX_Q14 &&
           free_for_robot(strategy->view_x_q4, strategy->view_y_q4);
}

/* Choose a place to look from: to the side of the opponent, behind whom the ball may be. Hardly
 * forward in the field: an unseen ball in the way must not end up in the opponent's goal. */
static void choose_viewpoint(strategy_t *strategy, const world_t *world)
{
    pose_t pose;

    odometry_pose(&world->odometry, &pose);
    strategy->side = (int8_t)-strategy->side;
    if (world->opponent.known && (view_from_aside(strategy, world, &pose, strategy->side) ||
                                  view_from_aside(strategy, world, &pose, -strategy->side)))
        return;
    strategy->view_x_q4 = pose.x_q4 < RELOCATE_X_MM * 16 ? pose.x_q4 : RELOCATE_X_MM * 16;
    strategy->view_y_q4 = strategy->side * RELOCATE_Y_MM * 16;
}

static void search(strategy_t *strategy, const world_t *world)
{
    set_wheels(strategy, 0, strategy->turn * strategy->tuning->search_turn_mm_s);
    /* Only eyes that have shown something are worth moving for. */
    if (lasts(strategy, strategy->tuning->search_ms) &&
        (world->own.localised || world->opponent.known)) {
        choose_viewpoint(strategy, world);
        enter(strategy, STRATEGY_RELOCATE, STRATEGY_NOT_FOUND);
    } else if (lasts(strategy, strategy->tuning->search_ms)) {
        strategy->state_ticks = 0;
    }
}

static void relocate(strategy_t *strategy, const world_t *world)
{
    pose_t pose;

    odometry_pose(&world->odometry, &pose);
    drive_to(strategy, world, &pose, strategy->view_x_q4, strategy->view_y_q4,
             strategy->tuning->relocate_mm_s);
    if (is_within(strategy->view_x_q4 - pose.x_q4, strategy->view_y_q4 - pose.y_q4,
                  VIEW_THERE_MM * 16))
        enter(strategy, STRATEGY_SEARCH, STRATEGY_VIEWPOINT);
    else if (lasts(strategy, strategy->tuning->relocate_ms))
        enter(strategy, STRATEGY_SEARCH, STRATEGY_NO_VIEWPOINT);
}

static void look(strategy_t *strategy, const world_t *world)
{
    set_wheels(strategy, 0, strategy->turn * strategy->tuning->search_turn_mm_s);
    if (world->own.localised || lasts(strategy, strategy->tuning->look_ms)) {
        strategy->looked = 1;
        enter(strategy, STRATEGY_APPROACH,
              world->own.localised ? STRATEGY_PLACE_KNOWN : STRATEGY_NO_GOAL_SEEN);
    }
}

/* Out of where it is stuck: away from the opponent if he is near, from a wall towards the pitch's
 * middle, forwards or backwards, whatever is nearer; else backwards. */
static void begin_back_off(strategy_t *strategy, const world_t *world, strategy_reason_t reason)
{
    const object_t *opponent = &world->opponent;
    pose_t pose;
    angle_t home;
    int32_t dx;
    int32_t dy;

    odometry_pose(&world->odometry, &pose);
    home = angle_wrap(angle_of(-pose.x_q4, -pose.y_q4) - pose.heading);
    strategy->escape = world->wall_ticks > 0 && angle_cos_q14(home) > 0 ? 1 : -1;
    dx = opponent->x_q4 - pose.x_q4;
    dy = opponent->y_q4 - pose.y_q4;
    if (opponent->known &&
        is_within(dx, dy, (uint32_t)(strategy->tuning->opponent_clear_mm + PASS_EXTRA_MM) * 16))
        strategy->escape = angle_cos_q14(angle_wrap(angle_of(dx, dy) - pose.heading)) > 0 ? -1 : 1;
    enter(strategy, STRATEGY_BACK_OFF, reason);
}

/* A point on the circle around the ball, `off` away from the pose behind it. */
static void waypoint(const strategy_t *strategy, const situation_t *now, angle_t off,
                     int32_t radius_mm, int32_t *x_q4, int32_t *y_q4)
{
    angle_t from_ball = angle_wrap(strategy->shot + off + 2 * ANGLE_90);

    *x_q4 = ahead_x(now->ball_x_q4, from_ball, radius_mm);
    *y_q4 = ahead_y(now->ball_y_q4, from_ball, radius_mm);
}

/* May the robot go around the ball that way (1: `off` falls, -1: it grows) until it is behind? */
static int way_is_free(const strategy_t *strategy, const world_t *world, const situation_t *now,
                       int direction)
{
    int32_t left = direction > 0 ? (uint16_t)now->off : (uint16_t)-now->off;
    int32_t x_q4;
    int32_t y_q4;

    for (left -= AROUND_CHECK; left > 0; left -= AROUND_CHECK) {
        waypoint(strategy, now, angle_wrap(direction * left), strategy->tuning->around_mm, &x_q4,
                 &y_q4);
        if (!free_for_robot(x_q4, y_q4))
            return 0;
        if (world->opponent.known && is_within(x_q4 - world->opponent.x_q4,
                                               y_q4 - world->opponent.y_q4, 2 * ROBOT_RADIUS * 16))
            return 0;
    }
    return 1;
}

/* The shorter way around if it is free, else the other; a choice made is kept while it is free. */
static void choose_way(strategy_t *strategy, const world_t *world, const situation_t *now)
{
    int8_t shorter = now->off >= 0 ? 1 : -1;

    if (strategy->around != 0 &&
        (strategy->plan_ticks != 0 || way_is_free(strategy, world, now, strategy->around)))
        return;
    if (!way_is_free(strategy, world, now, shorter) && way_is_free(strategy, world, now, -shorter))
        strategy->around = (int8_t)-shorter;
    else
        strategy->around = shorter;
}

/* Is the robot where it wanted to be, as near as walls let it? */
static int is_there(const pose_t *pose, int32_t x_q4, int32_t y_q4)
{
    int32_t dx = clamp(x_q4, FREE_X_MM * 16) - pose->x_q4;
    int32_t dy = clamp(y_q4, FREE_Y_MM * 16) - pose->y_q4;

    return size_of(dx) < THERE_MM * 16 && size_of(dy) < THERE_MM * 16;
}

/* Behind the ball as well as can be, though perhaps not exactly: turn to it and go. */
static void face_and_push(strategy_t *strategy, const situation_t *now)
{
    drive_along(strategy, &now->pose, now->ball_direction, 0);
    if (size_of(angle_wrap(now->ball_direction - now->pose.heading)) < FACE_ANGLE)
        enter(strategy, STRATEGY_PUSH, STRATEGY_NEARLY_BEHIND);
}

static void approach(strategy_t *strategy, const world_t *world, const situation_t *now)
{
    int32_t x_q4;
    int32_t y_q4;

    if (now->along_mm > PUSH_ALONG_MIN_MM && now->along_mm < PUSH_ALONG_MAX_MM &&
        size_of(now->off) < FROM_DEGREES(strategy->tuning->push_begin_deg)) {
        enter(strategy, STRATEGY_PUSH, STRATEGY_BEHIND_BALL);
        drive_along(strategy, &now->pose, now->ball_direction, strategy->tuning->push_mm_s);
        return;
    }
    if (size_of(now->off) <= DIRECT_ANGLE) {
        strategy->around = 0;
        waypoint(strategy, now, 0, strategy->tuning->behind_mm, &x_q4, &y_q4);
        if (is_there(&now->pose, x_q4, y_q4)) {
            face_and_push(strategy, now);
            return;
        }
    } else {
        choose_way(strategy, world, now);
        waypoint(strategy, now, angle_wrap(now->off - strategy->around * AROUND_STEP),
                 strategy->tuning->around_mm, &x_q4, &y_q4);
    }
    drive_to(strategy, world, &now->pose, x_q4, y_q4, strategy->tuning->approach_mm_s);
    if (is_there(&now->pose, x_q4, y_q4))
        begin_back_off(strategy, world, STRATEGY_NO_WAY);
    else if (lasts(strategy, strategy->tuning->approach_ms))
        begin_back_off(strategy, world, STRATEGY_TOO_LONG);
}

static void push(strategy_t *strategy, world_t *world, const situation_t *now)
{
    /* Seen from the robot the ball must go to `shot`: aim beyond the ball's middle by as much as
     * the line through both middles is off. */
    angle_t aim = angle_wrap(now->ball_direction + clamp(now->off, PUSH_AIM_MAX));
    int32_t blind_ms = strategy->tuning->push_blind_ms;

    drive_along(strategy, &now->pose, aim, strategy->tuning->push_mm_s);
    if (lasts(strategy, blind_ms) && world->ball.age_ticks * TICK_MS > blind_ms) {
        world->ball.known = 0;
        begin_turning(strategy, world, now->ball_direction);
        enter(strategy, STRATEGY_SEARCH, STRATEGY_BALL_LOST);
    } else if (size_of(now->off) > FROM_DEGREES(strategy->tuning->push_end_deg))
        enter(strategy, STRATEGY_APPROACH, STRATEGY_OFF_LINE);
    else if (now->distance_mm > strategy->tuning->push_lost_mm)
        enter(strategy, STRATEGY_APPROACH, STRATEGY_BALL_AWAY);
    else if (lasts(strategy, strategy->tuning->push_ms))
        begin_back_off(strategy, world, STRATEGY_TOO_LONG);
}

/* ---- Defence ---- */

/* Is the opponent, seen lately, nearer to the ball than the robot by `margin_mm`? */
static int opponent_is_nearer(const strategy_t *strategy, const world_t *world,
                              const situation_t *now, int32_t margin_mm)
{
    const object_t *opponent = &world->opponent;

    /* Behind the ball already: there is no better defence. */
    if (size_of(now->off) < FROM_DEGREES(strategy->tuning->defend_behind_deg))
        return 0;
    return opponent->known && opponent->age_ticks * TICK_MS < strategy->tuning->opponent_fresh_ms &&
           (int32_t)length_of(opponent->x_q4 - now->ball_x_q4, opponent->y_q4 - now->ball_y_q4) /
                       16 +
                   margin_mm <
               now->distance_mm;
}

/* On the line from the ball to the middle of the own goal, as near to the ball as is safe. */
static void defend(strategy_t *strategy, const world_t *world, const situation_t *now)
{
    int32_t home_x = -PITCH_HALF_LENGTH_MM * 16 - now->ball_x_q4;
    int32_t home_y = -now->ball_y_q4;
    int32_t home_mm = (int32_t)length_of(home_x, home_y) / 16 + 1;
    int32_t from_ball_mm = strategy->tuning->defend_ball_mm;
    int32_t x_q4;
    int32_t y_q4;

    if (from_ball_mm > home_mm - ROBOT_RADIUS)
        from_ball_mm = home_mm - ROBOT_RADIUS;
    x_q4 = now->ball_x_q4 + home_x * from_ball_mm / home_mm;
    y_q4 = now->ball_y_q4 + home_y * from_ball_mm / home_mm;
    if (is_within(x_q4 - now->pose.x_q4, y_q4 - now->pose.y_q4, DEFEND_THERE_MM * 16))
        drive_along(strategy, &now->pose, now->ball_direction, 0);
    else
        drive_to(strategy, world, &now->pose, x_q4, y_q4, strategy->tuning->defend_mm_s);
}

/* ---- Stalemate ---- */

/* Keep an eye on how long the ball has not moved. */
static void watch_stillness(strategy_t *strategy, const world_t *world)
{
    const object_t *ball = &world->ball;

    if (!ball->known || ball->age_ticks > STILL_AGE_TICKS)
        return;
    if (strategy->still_known && is_within(ball->x_q4 - strategy->still_x_q4,
                                           ball->y_q4 - strategy->still_y_q4, STILL_MM * 16))
        return;
    strategy->still_known = 1;
    strategy->still_x_q4 = ball->x_q4;
    strategy->still_y_q4 = ball->y_q4;
    strategy->still_ticks = 0;
}

/* Where the ball is taken to be stuck: an opponent who hides it stands at it. */
static void stuck_place(const strategy_t *strategy, const world_t *world, int32_t *x_q4,
                        int32_t *y_q4)
{
    const object_t *opponent = &world->opponent;

    *x_q4 = strategy->still_x_q4;
    *y_q4 = strategy->still_y_q4;
    if (!world->ball.known && opponent->known &&
        opponent->age_ticks * TICK_MS < strategy->tuning->opponent_fresh_ms) {
        *x_q4 = opponent->x_q4;
        *y_q4 = opponent->y_q4;
    }
}

/* Has the ball been in one place for so long that only a free ball gets it out? */
static int is_stuck_ball(const strategy_t *strategy, const world_t *world)
{
    const object_t *opponent = &world->opponent;
    int32_t still_ms = strategy->still_ticks * TICK_MS;
    int32_t x_q4;
    int32_t y_q4;

    if (!strategy->still_known || !world->own.localised ||
        still_ms <= strategy->tuning->pinned_ball_ms)
        return 0;
    if (still_ms > strategy->tuning->stuck_ball_ms)
        return 1;
    stuck_place(strategy, world, &x_q4, &y_q4);
    return opponent->known &&
           is_within(opponent->x_q4 - x_q4, opponent->y_q4 - y_q4, PINNED_MM * 16);
}

/* Where the referee will put the ball: the spot that is nearest to it and not near a robot. */
static void free_ball_spot(const strategy_t *strategy, const world_t *world, int32_t *x_q4,
                           int32_t *y_q4)
{
    const object_t *opponent = &world->opponent;
    uint32_t nearest = UINT32_MAX;
    int32_t ball_x_q4;
    int32_t ball_y_q4;
    unsigned i;

    stuck_place(strategy, world, &ball_x_q4, &ball_y_q4);
    for (i = 0; i < 4; i++) {
        int32_t x = (i & 1 ? FREE_BALL_X_MM : -FREE_BALL_X_MM) * 16;
        int32_t y = (i & 2 ? FREE_BALL_Y_MM : -FREE_BALL_Y_MM) * 16;
        uint32_t off = length_of(ball_x_q4 - x, ball_y_q4 - y);

        if (off >= nearest ||
            (opponent->known &&
             length_of(opponent->x_q4 - x, opponent->y_q4 - y) < FREE_BALL_MM * 16))
            continue;
        nearest = off;
        *x_q4 = x;
        *y_q4 = y;
    }
}

/* Behind that spot on the line to the goal, facing it. */
static void await_free_ball(strategy_t *strategy, const world_t *world)
{
    int32_t behind_mm = strategy->tuning->await_mm;
    int32_t spot_x_q4 = 0;
    int32_t spot_y_q4 = 0;
    angle_t shot;
    int32_t x_q4;
    int32_t y_q4;
    pose_t pose;

    odometry_pose(&world->odometry, &pose);
    free_ball_spot(strategy, world, &spot_x_q4, &spot_y_q4);
    shot = angle_of((PITCH_HALF_LENGTH_MM + GOAL_INSIDE_MM) * 16 - spot_x_q4, -spot_y_q4);
    x_q4 = ahead_x(spot_x_q4, shot, -behind_mm);
    y_q4 = ahead_y(spot_y_q4, shot, -behind_mm);
    if (is_within(x_q4 - pose.x_q4, y_q4 - pose.y_q4, AWAIT_THERE_MM * 16))
        drive_along(strategy, &pose, shot, 0);
    else
        drive_to(strategy, world, &pose, x_q4, y_q4, strategy->tuning->defend_mm_s);
}

static void await(strategy_t *strategy, const world_t *world)
{
    strategy->shot_known = 0;
    if (!is_stuck_ball(strategy, world))
        enter(strategy, world->ball.known ? STRATEGY_APPROACH : STRATEGY_SEARCH, STRATEGY_PLAY_ON);
    else if (lasts(strategy, strategy->tuning->await_ms)) {
        /* No referee, or nothing known of the ball: look for it. */
        strategy->still_known = 0;
        enter(strategy, STRATEGY_SEARCH, STRATEGY_TOO_LONG);
    } else
        await_free_ball(strategy, world);
}

/* ---- Everything together ---- */

static void back_off(strategy_t *strategy)
{
    if (!lasts(strategy, strategy->tuning->back_off_ms))
        set_wheels(strategy, strategy->escape * strategy->tuning->back_off_mm_s,
                   strategy->turn * BACK_OFF_CURVE_MM_S);
    else
        set_wheels(strategy, 0, strategy->turn * strategy->tuning->turn_max_mm_s);
    if (lasts(strategy, strategy->tuning->back_off_ms + strategy->tuning->back_off_turn_ms)) {
        strategy->turn = (int8_t)-strategy->turn;
        enter(strategy, STRATEGY_SEARCH, STRATEGY_FREE);
    }
}

static void forget_if(object_t *object, int32_t unseen_ms, int32_t age_ms)
{
    if (object->unseen_ticks * TICK_MS > unseen_ms || object->age_ticks * TICK_MS > age_ms)
        object->known = 0;
}

static void forget_the_lost(const soccer_tuning_t *tuning, world_t *world)
{
    forget_if(&world->ball, tuning->ball_unseen_ms, tuning->ball_forget_ms);
    forget_if(&world->opponent, tuning->opponent_unseen_ms, tuning->opponent_forget_ms);
}

/* Wheels that stand still, or that slip at a wall. */
static void notice_being_stuck(strategy_t *strategy, world_t *world)
{
    if (strategy->stuck_ticks * TICK_MS > strategy->tuning->stuck_ms)
        begin_back_off(strategy, world, STRATEGY_WHEELS_BLOCKED);
    else if (world->wall_ticks > WALL_TICKS)
        begin_back_off(strategy, world, STRATEGY_WALL);
    if (strategy->state == STRATEGY_BACK_OFF)
        world_slipped(world);
}

void strategy_start(strategy_t *strategy, const soccer_tuning_t *tuning)
{
    static const strategy_t fresh;

    *strategy = fresh;
    strategy->tuning = tuning;
    strategy->state = STRATEGY_SEARCH;
    strategy->turn = 1;
    strategy->side = 1;
}

void strategy_tick(strategy_t *strategy, const int32_t counts[2])
{
    const int16_t told[2] = {strategy->wheels.left_mm_s, strategy->wheels.right_mm_s};
    int stuck = 0;
    unsigned i;

    if (strategy->state_ticks < UINT16_MAX)
        strategy->state_ticks++;
    if (strategy->plan_ticks < UINT8_MAX)
        strategy->plan_ticks++;
    if (strategy->still_ticks < UINT16_MAX)
        strategy->still_ticks++;
    /* 60 mm/s are 7.2 counts a tick: 0.12 for each mm/s. */
    for (i = 0; i < 2; i++)
        if (size_of(told[i]) >= 60 &&
            size_of(counts[i]) * 10000 < size_of(told[i]) * 12 * strategy->tuning->stuck_percent)
            stuck = 1;
    if (!stuck)
        strategy->stuck_ticks = 0;
    else if (strategy->stuck_ticks < UINT16_MAX)
        strategy->stuck_ticks++;
}

/* Nobody knows where the ball is. */
static void without_ball(strategy_t *strategy, const world_t *world)
{
    strategy->shot_known = 0;
    if (strategy->state != STRATEGY_SEARCH && strategy->state != STRATEGY_RELOCATE) {
        begin_turning(strategy, world, world->last_ball_bearing);
        enter(strategy, STRATEGY_SEARCH, STRATEGY_BALL_LOST);
    }
    if (strategy->state == STRATEGY_SEARCH)
        search(strategy, world);
    else
        relocate(strategy, world);
}

static void with_ball(strategy_t *strategy, world_t *world)
{
    const soccer_tuning_t *tuning = strategy->tuning;
    situation_t now;

    look_around(strategy, world, &now);
    if (strategy->state == STRATEGY_DEFEND) {
        if (!opponent_is_nearer(strategy, world, &now, tuning->defend_margin_mm / 2))
            enter(strategy, STRATEGY_APPROACH, STRATEGY_OPPONENT_FARTHER);
    } else if (strategy->state != STRATEGY_PUSH) {
        enter(strategy, STRATEGY_APPROACH, STRATEGY_BALL_FOUND);
        if (opponent_is_nearer(strategy, world, &now, tuning->defend_margin_mm))
            enter(strategy, STRATEGY_DEFEND, STRATEGY_OPPONENT_NEARER);
    }
    if (strategy->state == STRATEGY_PUSH)
        push(strategy, world, &now);
    else if (strategy->state == STRATEGY_DEFEND)
        defend(strategy, world, &now);
    else
        approach(strategy, world, &now);
}

void strategy_decide(strategy_t *strategy, world_t *world, wheels_t *wheels)
{
    forget_the_lost(strategy->tuning, world);
    watch_stillness(strategy, world);
    if (strategy->state != STRATEGY_BACK_OFF)
        notice_being_stuck(strategy, world);

    if (strategy->state != STRATEGY_BACK_OFF && is_stuck_ball(strategy, world))
        enter(strategy, STRATEGY_AWAIT, STRATEGY_STALEMATE);

    if (strategy->state == STRATEGY_BACK_OFF) {
        back_off(strategy);
    } else if (strategy->state == STRATEGY_AWAIT) {
        await(strategy, world);
    } else if (!world->ball.known) {
        without_ball(strategy, world);
    } else if (!world->own.localised && !strategy->looked) {
        if (strategy->state != STRATEGY_LOOK)
            begin_turning(strategy, world, 0);
        enter(strategy, STRATEGY_LOOK, STRATEGY_PLACE_UNKNOWN);
        look(strategy, world);
    } else {
        with_ball(strategy, world);
    }
    *wheels = strategy->wheels;
}

/* ---- For humans ---- */

int strategy_take_event(strategy_t *strategy, strategy_event_t *event)
{
    if (strategy->event_count == 0)
        return 0;
    *event = strategy->events[strategy->event_first];
    strategy->event_first = (uint8_t)((strategy->event_first + 1u) % STRATEGY_EVENTS);
    strategy->event_count--;
    return 1;
}

const char *strategy_state_name(strategy_state_t state)
{
    static const char *const names[STRATEGY_STATE_COUNT] = {
        "search", "relocate", "look", "approach", "push", "defend", "back off", "await",
    };

    return state < STRATEGY_STATE_COUNT ? names[state] : "unknown";
}

const char *strategy_reason_name(strategy_reason_t reason)
{
#define REASON_TEXT(identifier, text) text,
    static const char *const names[STRATEGY_REASON_COUNT] = {STRATEGY_REASONS(REASON_TEXT)};
#undef REASON_TEXT

    return reason < STRATEGY_REASON_COUNT ? names[reason] : "unknown";
}
