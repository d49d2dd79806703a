#include "imagined_pitch.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "drivers/stop_word.h"
#include "vision/camera.h"

#define STEP_S          0.001
#define PI              3.14159265358979
#define HALF_LENGTH     525.0
#define HALF_WIDTH      340.0
#define GOAL_HALF       150.0
#define GOAL_DEPTH      70.0
#define CORNER          50.0
#define BALL_R          33.5
#define ROBOT_R         30.0
#define WHEEL_BASE      53.0
#define FRAME_S         0.025
#define EXPOSURE_TO_END (CAMERA_EXPOSURE_TO_END_US / 1e6)
#define REPORT_DELAY_S  0.004
#define VIEW_HALF_ANGLE (26 * PI / 180)
#define MOTOR_MM_S      1000.0
#define MOTOR_TAU_S     0.05
#define BALL_SLOWING    250.0
#define RESTITUTION     0.5

/* ---- Random numbers ---- */

static double uniform(pitch_t *pitch, double low, double high)
{
    pitch->random ^= pitch->random << 13;
    pitch->random ^= pitch->random >> 17;
    pitch->random ^= pitch->random << 5;
    return low + (high - low) * (pitch->random / 4294967296.0);
}

/* About normal: the sum of three uniform ones. */
static double normal(pitch_t *pitch, double sigma)
{
    double sum = uniform(pitch, -1, 1) + uniform(pitch, -1, 1) + uniform(pitch, -1, 1);

    return sum * sigma * pitch->noise;
}

/* ---- The eyes ---- */

typedef struct {
    double x_right, x_left, y, depth, disparity;
} seen_t;

/* Project a point of the field; 0 if it is behind the lenses. */
static int project(const pitch_t *pitch, double x, double y, double height, seen_t *seen)
{
    double focal = CAMERA_FOCAL_PX;
    double sine = CAMERA_TILT_SIN_Q12 / 4096.0;
    double cosine = CAMERA_TILT_COS_Q12 / 4096.0;
    double dx = x - pitch->x;
    double dy = y - pitch->y;
    double forward = dx * cos(pitch->heading) + dy * sin(pitch->heading);
    double left = -dx * sin(pitch->heading) + dy * cos(pitch->heading);
    double drop = CAMERA_LENS_HEIGHT_MM - height;

    seen->depth = forward * cosine + drop * sine;
    if (seen->depth < 20)
        return 0;
    seen->disparity = focal * CAMERA_BASELINE_UM / 1000.0 / seen->depth;
    seen->x_right =
        CAMERA_CX_Q4 / 16.0 - focal * (left + CAMERA_RIGHT_LENS_MM_Q4 / 16.0) / seen->depth;
    seen->x_left = seen->x_right + seen->disparity;
    seen->y = CAMERA_CY_Q4 / 16.0 + focal * (drop * cosine - forward * sine) / seen->depth;
    return 1;
}

/* Does the opponent stand before (x, y), seen from the robot? */
static int hidden(const pitch_t *pitch, double x, double y)
{
    double dx = x - pitch->x;
    double dy = y - pitch->y;
    double ox = pitch->opponent_x - pitch->x;
    double oy = pitch->opponent_y - pitch->y;
    double distance = hypot(dx, dy);
    double along = (ox * dx + oy * dy) / distance;

    return pitch->has_opponent && along > 0 && along < distance &&
           fabs(ox * dy - oy * dx) / distance < ROBOT_R + 2;
}

static uint16_t q4(double value)
{
    return (uint16_t)(value <= 0 ? 0 : value * 16 + 0.5);
}

/* Does any part of the ball lie within the angle that the eyes see, and a little more? */
static int ball_within_view(const pitch_t *pitch)
{
    double dx = pitch->ball_x - pitch->x;
    double dy = pitch->ball_y - pitch->y;
    double distance = fmax(hypot(dx, dy), BALL_R + 1);
    double bearing = remainder(atan2(dy, dx) - pitch->heading, 2 * PI);

    return fabs(bearing) - asin(BALL_R / distance) < VIEW_HALF_ANGLE;
}

/* A strip of the ball, cut at the picture's edges; a cut one is taken to be as wide as `high`. 0 if
 * nothing is left of it. */
static int strip(double middle, double width, double high, double *x, double *visible)
{
    double first = fmax(middle - width / 2, 0);
    double last = fmin(middle + width / 2, CAMERA_WIDTH_PX - 1);

    if (last - first < 9)
        return 0;
    *visible = last - first;
    *x = (first + last) / 2;
    if (first == 0 && high > *visible)
        *x = last - high / 2;
    else if (last == CAMERA_WIDTH_PX - 1 && high > *visible)
        *x = first + high / 2;
    return 1;
}

static void see_ball(pitch_t *pitch, report_t *report)
{
    seen_t seen;
    double width;
    double top;
    double bottom;
    double middle;
    double x[2];
    double visible[2];
    int clipped;
    int right;
    int left;

    if (!project(pitch, pitch->ball_x, pitch->ball_y, BALL_R, &seen) || seen.depth < BALL_R + 5 ||
        !ball_within_view(pitch) || hidden(pitch, pitch->ball_x, pitch->ball_y) ||
        uniform(pitch, 0, 1) < 0.02 * pitch->noise)
        return;
    width = 2 * BALL_R * CAMERA_FOCAL_PX / sqrt(seen.depth * seen.depth - BALL_R * BALL_R);
    top = seen.y - width / 2;
    bottom = fmin(seen.y + width / 2, CAMERA_HEIGHT_PX - 1);
    if (bottom - top < 9)
        return;
    /* Below the picture it would be wider. */
    if (seen.y > bottom)
        width = 2 * sqrt(width * width / 4 - (seen.y - bottom) * (seen.y - bottom));
    right = strip(seen.x_right, width, bottom - top, &x[1], &visible[1]);
    left = strip(seen.x_left, width, bottom - top, &x[0], &visible[0]);
    if (!right && !left)
        return;
    /* A pair with a disparity knows how wide the ball is, and so its middle beyond a cut end. */
    clipped = seen.disparity > 79 || bottom > CAMERA_HEIGHT_PX - 2;
    middle = right && left && !clipped ? seen.x_right : right ? x[1] : x[0];
    report->flags |= REPORT_BALL;
    report->ball_row = (uint8_t)fmax((top + bottom) / 2 + normal(pitch, 0.7), 0);
    report->ball_x_q4 = q4(fmin(middle + normal(pitch, 0.3), CAMERA_WIDTH_PX - 1));
    report->ball_width_px = (uint8_t)fmin(right ? visible[1] : visible[0], 255);
    report->ball_confidence = 200;
    if (clipped)
        report->flags |= REPORT_BALL_CLIPPED;
    if (!right)
        report->flags |= REPORT_BALL_LEFT_ONLY;
    else if (!left)
        report->flags |= REPORT_BALL_RIGHT_ONLY;
    else if (!(report->flags & REPORT_BALL_CLIPPED))
        report->ball_disparity_q4 = q4(seen.disparity + normal(pitch, 0.3));
}

static void see_goal(pitch_t *pitch, report_t *report)
{
    double side = cos(pitch->heading) > 0 ? 1 : -1;
    unsigned i;

    for (i = 0; i < 2; i++) {
        double x = side * HALF_LENGTH;
        double y = (i == 0 ? side : -side) * GOAL_HALF;
        seen_t seen;

        if (!project(pitch, x, y, 95, &seen) || hidden(pitch, x, y) || seen.x_right < 5 ||
            seen.x_right > CAMERA_WIDTH_PX - 6 || seen.x_left > CAMERA_WIDTH_PX - 6 ||
            seen.disparity > 79 || uniform(pitch, 0, 1) < 0.03 * pitch->noise)
            continue;
        report->flags |= i == 0 ? REPORT_GOAL_LEFT_EDGE : REPORT_GOAL_RIGHT_EDGE;
        report->goal_x_q4[i] = q4(seen.x_right + normal(pitch, 0.5));
        report->goal_disparity_q4[i] = q4(seen.disparity + normal(pitch, 0.4));
        report->goal_confidence = 12;
    }
}

static void see_opponent(pitch_t *pitch, report_t *report)
{
    double dx = pitch->opponent_x - pitch->x;
    double dy = pitch->opponent_y - pitch->y;
    double distance = hypot(dx, dy);
    seen_t seen;

    if (!pitch->has_opponent ||
        !project(pitch, pitch->opponent_x - dx / distance * ROBOT_R,
                 pitch->opponent_y - dy / distance * ROBOT_R, 60, &seen) ||
        seen.x_right < 10 || seen.x_right > CAMERA_WIDTH_PX - 11 || seen.disparity > 79)
        return;
    report->flags |= REPORT_OPPONENT;
    report->opponent_x_q4 = q4(seen.x_right + normal(pitch, 1));
    report->opponent_disparity_q4 = q4(seen.disparity + normal(pitch, 0.5));
    report->opponent_confidence = 10;
}

/* How far along a line on the floor from (x, y) in direction (dx, dy), in lengths of that, the
 * nearest wall is; a goal is black, floor and all, and so its mouth is a wall. */
static double way_to_wall(double x, double y, double dx, double dy)
{
    static const double quarter[4][2] = {{HALF_LENGTH, GOAL_HALF - 1},
                                         {HALF_LENGTH, GOAL_HALF},
                                         {HALF_LENGTH, HALF_WIDTH - CORNER},
                                         {HALF_LENGTH - CORNER, HALF_WIDTH}};
    double nearest = 1e9;
    unsigned i;

    for (i = 0; i < 16; i++) {
        double end[2][2];
        double along;
        double at;
        double across;
        unsigned k;

        for (k = 0; k < 2; k++) {
            unsigned corner = (i + k) % 16;
            const double *q = quarter[corner / 4 % 2 ? 3 - corner % 4 : corner % 4];

            end[k][0] = corner / 4 == 1 || corner / 4 == 2 ? -q[0] : q[0];
            end[k][1] = corner / 4 >= 2 ? -q[1] : q[1];
        }
        across = dx * (end[1][1] - end[0][1]) - dy * (end[1][0] - end[0][0]);
        if (fabs(across) < 1e-9)
            continue;
        along = ((end[0][0] - x) * (end[1][1] - end[0][1]) -
                 (end[0][1] - y) * (end[1][0] - end[0][0])) /
                across;
        at = ((end[0][0] - x) * dy - (end[0][1] - y) * dx) / across;
        if (along > 0 && along < nearest && at >= 0 && at <= 1)
            nearest = along;
    }
    return nearest;
}

/* The foot of the wall in three columns of the right eye. */
static void see_wall(pitch_t *pitch, report_t *report)
{
    static const uint16_t columns[REPORT_WALL_COLUMNS] = {
        REPORT_WALL_COLUMN_LEFT, REPORT_WALL_COLUMN_CENTRE, REPORT_WALL_COLUMN_RIGHT};
    double sine = CAMERA_TILT_SIN_Q12 / 4096.0;
    double cosine = CAMERA_TILT_COS_Q12 / 4096.0;
    unsigned i;

    for (i = 0; i < REPORT_WALL_COLUMNS; i++) {
        /* What a column sees of the floor is a line: right = slope * depth. */
        double slope = (columns[i] - CAMERA_CX_Q4 / 16.0) / CAMERA_FOCAL_PX;
        double left = -slope * CAMERA_LENS_HEIGHT_MM * sine - CAMERA_RIGHT_LENS_MM_Q4 / 16.0;
        double turn = -slope * cosine;
        double x = pitch->x - left * sin(pitch->heading);
        double y = pitch->y + left * cos(pitch->heading);
        double dx = cos(pitch->heading) - turn * sin(pitch->heading);
        double dy = sin(pitch->heading) + turn * cos(pitch->heading);
        double way = way_to_wall(x, y, dx, dy);
        double ball = (pitch->ball_x - x) * dy - (pitch->ball_y - y) * dx;
        seen_t seen;
        double row;

        if (!project(pitch, x + way * dx, y + way * dy, 0, &seen) ||
            hidden(pitch, x + way * dx, y + way * dy) ||
            (fabs(ball) < (BALL_R + 3) * hypot(dx, dy) &&
             (pitch->ball_x - x) * dx + (pitch->ball_y - y) * dy > 0) ||
            uniform(pitch, 0, 1) < 0.05 * pitch->noise)
            continue;
        row = seen.y + normal(pitch, 0.7);
        if (row < 10 || row > CAMERA_HEIGHT_PX - 6)
            continue;
        report->flags |= REPORT_WALL;
        report->wall_row[i] = (uint8_t)lround(row + 0.5);
    }
}

static void expose(pitch_t *pitch)
{
    pitch_report_t *sent = &pitch->under_way[pitch->under_way_count];
    report_t *report = &sent->report;

    if (pitch->eyes == EYES_DEAD || pitch->under_way_count == PITCH_REPORTS_UNDER_WAY)
        return;
    memset(report, 0, sizeof *report);
    report->function = FPGA_FUNCTION_SOCCER;
    report->sequence = pitch->sequence;
    if (pitch->eyes != EYES_FROZEN)
        pitch->sequence++;
    report->exposure_time = (uint16_t)(uint64_t)(pitch->time_s * 10000);
    report->delay = (uint8_t)(REPORT_DELAY_S * 10000);
    if (pitch->eyes != EYES_BLACK && pitch->eyes != EYES_BLIND_TO_BALL)
        see_ball(pitch, report);
    if (pitch->eyes != EYES_BLACK) {
        see_wall(pitch, report);
        see_goal(pitch, report);
        see_opponent(pitch, report);
    }
    sent->due_s = pitch->time_s + EXPOSURE_TO_END + REPORT_DELAY_S;
    pitch->under_way_count++;
}

/* ---- The base ---- */

static void base_encoders(void *context, int32_t counts[2])
{
    const pitch_t *pitch = context;

    counts[0] = (int32_t)floor(pitch->travel_mm[0] * 12);
    counts[1] = (int32_t)floor(pitch->travel_mm[1] * 12);
}

static void base_motors(void *context, int16_t left, int16_t right)
{
    pitch_t *pitch = context;

    pitch->duty[0] = left;
    pitch->duty[1] = right;
}

static int base_report(void *context, uint8_t wire[REPORT_SIZE], uint16_t *age_100us)
{
    pitch_t *pitch = context;

    if (pitch->under_way_count == 0 || pitch->under_way[0].due_s > pitch->time_s)
        return 0;
    report_encode(&pitch->under_way[0].report, wire);
    if (pitch->eyes == EYES_DAMAGED) {
        unsigned bit = (unsigned)uniform(pitch, 0, 8 * REPORT_SIZE);

        wire[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
    *age_100us = (uint16_t)((pitch->time_s - pitch->under_way[0].due_s) * 10000);
    pitch->under_way_count--;
    memmove(&pitch->under_way[0], &pitch->under_way[1],
            pitch->under_way_count * sizeof pitch->under_way[0]);
    return 1;
}

static int base_console_waits(void *context)
{
    return *((pitch_t *)context)->typed != '\0';
}

static int base_console_read(void *context)
{
    pitch_t *pitch = context;

    if (*pitch->typed == '\0')
        return -1;
    if (stop_word_take(&pitch->stop_matched, (uint8_t)*pitch->typed))
        pitch->stop_word = 1;
    return (uint8_t)*pitch->typed++;
}

static void base_console_write(void *context, const char *characters, uint16_t count)
{
    pitch_t *pitch = context;

    for (; count > 0 && pitch->printed_count + 1 < PITCH_CONSOLE_SIZE; count--)
        pitch->printed[pitch->printed_count++] = *characters++;
    pitch->printed[pitch->printed_count] = '\0';
}

static uint32_t base_console_room(void *context)
{
    (void)context;
    return PITCH_CONSOLE_SIZE;
}

static int base_console_sent(void *context)
{
    (void)context;
    return 1;
}

static void base_console_baud(void *context, uint32_t baud)
{
    ((pitch_t *)context)->baud = baud;
}

static int base_stop_word(void *context)
{
    pitch_t *pitch = context;
    int found = pitch->stop_word;

    pitch->stop_word = 0;
    return found;
}

static void base_register_begin(void *context, uint8_t address, const uint16_t *value)
{
    (void)context;
    (void)address;
    (void)value;
}

static turret_register_t base_register_state(void *context, uint16_t *value)
{
    (void)context;
    (void)value;
    return TURRET_REGISTER_FAILED;
}

static void base_sensors(void *context, adc_readings_t *readings)
{
    *readings = ((const pitch_t *)context)->sensors;
}

static uint8_t base_bus_read(void *context, uint8_t address)
{
    return ((const pitch_t *)context)->extension[address];
}

static void base_bus_write(void *context, uint8_t address, uint8_t value)
{
    ((pitch_t *)context)->extension[address] = value;
}

static uint16_t base_fine(void *context)
{
    return (uint16_t)(uint64_t)(((const pitch_t *)context)->time_s * BASE_FINE_HZ);
}

static void base_restart(void *context, base_restart_t how)
{
    ((pitch_t *)context)->restarted = 1 + (int)how;
}

static void base_leds(void *context, uint8_t leds)
{
    ((pitch_t *)context)->leds = leds;
}

static const crash_record_t *base_crash(void *context)
{
    return ((const pitch_t *)context)->crash;
}

static void base_crash_clear(void *context)
{
    ((pitch_t *)context)->crash = NULL;
}

static uint32_t base_stack_used(void *context)
{
    (void)context;
    return 512;
}

static uint16_t base_none_lost(void *context)
{
    (void)context;
    return 0;
}

/* ---- Bodies ---- */

static void move_wheels(pitch_t *pitch)
{
    unsigned i;

    for (i = 0; i < 2; i++) {
        double wanted = pitch->duty[i] * MOTOR_MM_S / 256;

        pitch->wheel_mm_s[i] += (wanted - pitch->wheel_mm_s[i]) * STEP_S / MOTOR_TAU_S;
        pitch->travel_mm[i] += pitch->wheel_mm_s[i] * STEP_S;
    }
}

static void push_out(double *x, double *y, double from_x, double from_y, double distance)
{
    double dx = *x - from_x;
    double dy = *y - from_y;
    double now = hypot(dx, dy);

    if (now >= distance || now == 0)
        return;
    *x = from_x + dx / now * distance;
    *y = from_y + dy / now * distance;
}

/* The pitch's corners are cut by 50 mm: keep a disc of radius `radius` inside. */
static void cut_corner(double *x, double *y, double *vx, double *vy, double radius)
{
    double limit = HALF_LENGTH + HALF_WIDTH - CORNER - radius * sqrt(2);
    double over = fabs(*x) + fabs(*y) - limit;
    double nx = copysign(sqrt(0.5), *x);
    double ny = copysign(sqrt(0.5), *y);
    double speed = *vx * nx + *vy * ny;

    if (over <= 0)
        return;
    *x -= copysign(over / 2, *x);
    *y -= copysign(over / 2, *y);
    if (speed > 0) {
        *vx -= nx * speed * (1 + RESTITUTION);
        *vy -= ny * speed * (1 + RESTITUTION);
    }
}

static void move_robot(pitch_t *pitch)
{
    double forward = (pitch->wheel_mm_s[0] + pitch->wheel_mm_s[1]) / 2;
    double turn = (pitch->wheel_mm_s[1] - pitch->wheel_mm_s[0]) / WHEEL_BASE;
    double no_speed[2] = {0, 0};
    double end;

    pitch->heading += turn * STEP_S;
    pitch->x += forward * cos(pitch->heading) * STEP_S;
    pitch->y += forward * sin(pitch->heading) * STEP_S;
    if (pitch->has_opponent) {
        double before = pitch->x;

        push_out(&pitch->x, &pitch->y, pitch->opponent_x, pitch->opponent_y, 2 * ROBOT_R);
        if (pitch->x != before)
            pitch->touching_opponent_s += STEP_S;
    }
    end = HALF_LENGTH + (fabs(pitch->y) < GOAL_HALF - ROBOT_R ? GOAL_DEPTH : 0) - ROBOT_R;
    pitch->x = fmin(fmax(pitch->x, -end), end);
    pitch->y = fmin(fmax(pitch->y, -HALF_WIDTH + ROBOT_R), HALF_WIDTH - ROBOT_R);
    if (fabs(pitch->x) > HALF_LENGTH - ROBOT_R)
        pitch->y = fmin(fmax(pitch->y, -GOAL_HALF + ROBOT_R), GOAL_HALF - ROBOT_R);
    cut_corner(&pitch->x, &pitch->y, &no_speed[0], &no_speed[1], ROBOT_R);
}

/* The ball meets a disc that moves with (vx, vy) and is not moved by it. */
static void ball_meets(pitch_t *pitch, double x, double y, double vx, double vy)
{
    double dx = pitch->ball_x - x;
    double dy = pitch->ball_y - y;
    double distance = hypot(dx, dy);
    double nearing;

    if (distance >= BALL_R + ROBOT_R || distance == 0)
        return;
    dx /= distance;
    dy /= distance;
    nearing = (vx - pitch->ball_vx) * dx + (vy - pitch->ball_vy) * dy;
    if (nearing > 0) {
        pitch->ball_vx += dx * nearing * (1 + RESTITUTION * 0.6);
        pitch->ball_vy += dy * nearing * (1 + RESTITUTION * 0.6);
    }
    push_out(&pitch->ball_x, &pitch->ball_y, x, y, BALL_R + ROBOT_R);
}

static void bounce(double *position, double *speed, double low, double high)
{
    if (*position < low) {
        *position = low;
        *speed = fabs(*speed) * RESTITUTION;
    } else if (*position > high) {
        *position = high;
        *speed = -fabs(*speed) * RESTITUTION;
    }
}

static void move_ball(pitch_t *pitch)
{
    double speed = hypot(pitch->ball_vx, pitch->ball_vy);
    double left = speed > BALL_SLOWING * STEP_S ? 1 - BALL_SLOWING * STEP_S / speed : 0;
    double forward = (pitch->wheel_mm_s[0] + pitch->wheel_mm_s[1]) / 2;
    int in_mouth;
    double end;

    pitch->ball_vx *= left;
    pitch->ball_vy *= left;
    pitch->ball_x += pitch->ball_vx * STEP_S;
    pitch->ball_y += pitch->ball_vy * STEP_S;
    ball_meets(pitch, pitch->x, pitch->y, forward * cos(pitch->heading),
               forward * sin(pitch->heading));
    if (pitch->has_opponent)
        ball_meets(pitch, pitch->opponent_x, pitch->opponent_y, 0, 0);
    in_mouth = fabs(pitch->ball_y) < GOAL_HALF - BALL_R;
    end = in_mouth || fabs(pitch->ball_x) > HALF_LENGTH ? HALF_LENGTH + GOAL_DEPTH : HALF_LENGTH;
    bounce(&pitch->ball_x, &pitch->ball_vx, -end + BALL_R, end - BALL_R);
    end = fabs(pitch->ball_x) > HALF_LENGTH ? GOAL_HALF : HALF_WIDTH;
    bounce(&pitch->ball_y, &pitch->ball_vy, -end + BALL_R, end - BALL_R);
    cut_corner(&pitch->ball_x, &pitch->ball_y, &pitch->ball_vx, &pitch->ball_vy, BALL_R);
    if (pitch->ball_x > HALF_LENGTH + BALL_R)
        pitch->goals_for++;
    else if (pitch->ball_x < -HALF_LENGTH - BALL_R)
        pitch->goals_against++;
}

/* ---- Time ---- */

void pitch_run(pitch_t *pitch, double seconds)
{
    long steps = lround(seconds / STEP_S);
    long step;

    for (step = 0; step < steps && pitch->goals_for + pitch->goals_against == 0; step++) {
        long ms = lround(pitch->time_s / STEP_S);

        if (pitch->time_s >= pitch->next_frame_s) {
            expose(pitch);
            pitch->next_frame_s += FRAME_S;
        }
        if (ms % 10 == 0)
            robot_tick(&pitch->robot);
        robot_poll(&pitch->robot);
        move_wheels(pitch);
        move_robot(pitch);
        move_ball(pitch);
        pitch->time_s += STEP_S;
    }
}

static void place_bodies(pitch_t *pitch)
{
    pitch->x = uniform(pitch, -480, -60);
    pitch->y = uniform(pitch, -290, 290);
    pitch->heading = uniform(pitch, -PI, PI);
    do {
        pitch->ball_x = uniform(pitch, -400, 400);
        pitch->ball_y = uniform(pitch, -230, 230);
    } while (hypot(pitch->ball_x - pitch->x, pitch->ball_y - pitch->y) < 90);
    do {
        pitch->opponent_x = uniform(pitch, -460, 460);
        pitch->opponent_y = uniform(pitch, -280, 280);
    } while (hypot(pitch->opponent_x - pitch->x, pitch->opponent_y - pitch->y) < 90 ||
             hypot(pitch->opponent_x - pitch->ball_x, pitch->opponent_y - pitch->ball_y) < 90);
}

static const uint8_t build_id_of_tests[BUILD_ID_BYTES] = {0xAB, 0xCD};

void pitch_begin(pitch_t *pitch, uint32_t seed, pitch_eyes_t eyes, double noise)
{
    unsigned i;

    memset(pitch, 0, sizeof *pitch);
    pitch->eyes = eyes;
    pitch->noise = noise;
    pitch->has_opponent = 1;
    pitch->random = seed * 2654435761u + 1;
    for (i = 0; i < 8; i++)
        (void)uniform(pitch, 0, 1);
    place_bodies(pitch);
    pitch->typed = "";
    pitch->base.context = pitch;
    pitch->base.encoders = base_encoders;
    pitch->base.motors = base_motors;
    pitch->base.report = base_report;
    pitch->base.console_waits = base_console_waits;
    pitch->base.console_read = base_console_read;
    pitch->base.console_write = base_console_write;
    pitch->base.console_room = base_console_room;
    pitch->base.console_sent = base_console_sent;
    pitch->base.console_baud = base_console_baud;
    pitch->base.stop_word = base_stop_word;
    pitch->base.register_begin = base_register_begin;
    pitch->base.register_state = base_register_state;
    pitch->base.sensors = base_sensors;
    pitch->base.bus_read = base_bus_read;
    pitch->base.bus_write = base_bus_write;
    pitch->base.fine = base_fine;
    pitch->base.restart = base_restart;
    pitch->base.build_id = build_id_of_tests;
    pitch->base.stack_size = 8192;
    pitch->base.leds = base_leds;
    pitch->base.reset_cause = "power";
    pitch->base.crash = base_crash;
    pitch->base.crash_clear = base_crash_clear;
    pitch->base.stack_used = base_stack_used;
    pitch->base.console_lost = base_none_lost;
    pitch->base.reports_lost = base_none_lost;
    robot_init(&pitch->robot, &pitch->base);
}

void pitch_type(pitch_t *pitch, const char *line)
{
    pitch->typed = line;
}

double pitch_play(pitch_t *pitch, double seconds)
{
    double begin = pitch->time_s;

    snprintf(pitch->start_line, sizeof pitch->start_line, "start %ld\n",
             lround(pitch->heading * 180 / PI));
    pitch_type(pitch, pitch->start_line);
    pitch_run(pitch, seconds);
    return pitch->time_s - begin;
}
