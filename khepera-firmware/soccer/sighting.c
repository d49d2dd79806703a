#include "soccer/sighting.h"

#include "soccer/angle.h"
#include "vision/camera.h"
#include "vision/depth.h"

/* How far the lenses are ahead of the middle between the wheels. An assumption: the makers' drawing
 * is not public. */
#define LENS_FORWARD_MM 0

#define BALL_RADIUS_MM    ((BALL_DIAMETER_MM + 1) / 2)
/* Rows of the epipolar lines after reset of the FPGA; nobody changes them. */
#define GOAL_ROW          60u
#define OPPONENT_ROW      80u
#define SIGMA_MAX_MM      400u
/* How well the place of a ball is known that the picture's side cuts, or its lower border. */
#define NEAR_SIGMA_MM     15
#define TOP_SIGMA_MM      4
/* A ball that reaches below that row is taken to be cut by the lower border. */
#define CUT_ROW           236
/* A ray that falls less than that, 5 degrees, does not graze the top of a ball so near. */
#define DOWN_MIN_Q12      357
/* Ball and robot touch. */
#define NEAREST_MM        60
/* What is farther than the pitch's diagonal is not on it. */
#define RANGE_MAX_MM      1300
/* A wall's foot farther away is too coarse. */
#define WALL_RANGE_MAX_MM 800

static uint16_t range_sigma_mm(const soccer_tuning_t *tuning, uint16_t disparity_q4)
{
    uint32_t sigma = (uint32_t)depth_step_mm(disparity_q4) * (uint16_t)tuning->disparity_sigma_q4;

    return (uint16_t)(sigma > SIGMA_MAX_MM ? SIGMA_MAX_MM : sigma + 2);
}

static void fill(place_t *place, const ground_point_t *point, uint16_t sigma_mm)
{
    place->valid = point->forward_mm < RANGE_MAX_MM && point->left_mm < RANGE_MAX_MM &&
                   point->left_mm > -RANGE_MAX_MM;
    place->forward_mm = (int16_t)(point->forward_mm + LENS_FORWARD_MM);
    place->left_mm = point->left_mm;
    place->sigma_mm = sigma_mm;
}

/* A place from one pixel of the right eye and its disparity. Returns its height, mm. */
static int16_t place_by_disparity(const soccer_tuning_t *tuning, place_t *place, uint16_t x_q4,
                                  uint16_t row, uint16_t disparity)
{
    ground_point_t point;

    if (!depth_ground_point(x_q4, (uint16_t)(16u * row), disparity, &point))
        return INT16_MIN;
    fill(place, &point, range_sigma_mm(tuning, disparity));
    return point.height_mm;
}

/* A ball on the floor seen by one eye, or nearer than the search range: its row tells the range. */
static void place_by_row(place_t *ball, const report_t *report)
{
    ground_point_t point;

    if (!depth_on_plane(report->ball_x_q4, (uint16_t)(16u * report->ball_row), BALL_RADIUS_MM,
                        &point))
        return;
    /* One row, at the ball's height: range^2 / (f * 60 mm). */
    fill(ball, &point,
         (uint16_t)(3 + (int32_t)point.forward_mm * point.forward_mm / (CAMERA_FOCAL_PX * 30)));
}

/* Cut by the picture's lower border: `ball_row` is then the middle of what is seen, and the row of
 * its top tells the range. The ray that grazes the top falls by v of the axis' length, v = (top -
 * cy) / f, turned by the tilt: forward = (h cos t - R) / sin t for its angle t below the horizon
 * and the middle h below the lenses. */
static void place_by_top(place_t *ball, const report_t *report)
{
    const int32_t below_mm = CAMERA_LENS_HEIGHT_MM - BALL_RADIUS_MM;
    const int32_t below_half_mm = 2 * CAMERA_LENS_HEIGHT_MM - BALL_DIAMETER_MM;
    int32_t top = 2 * (int32_t)report->ball_row - (CAMERA_HEIGHT_PX - 1);
    int32_t fall_q12 = (16 * top - CAMERA_CY_Q4) * 256 / CAMERA_FOCAL_PX;
    int32_t length_q12 = 4096 + fall_q12 * fall_q12 / 8192;
    int32_t down_q12 = CAMERA_TILT_SIN_Q12 + (fall_q12 * CAMERA_TILT_COS_Q12 >> 12);
    int32_t ahead_q12 = CAMERA_TILT_COS_Q12 - (fall_q12 * CAMERA_TILT_SIN_Q12 >> 12);
    int32_t forward;
    int32_t depth;

    if (down_q12 < DOWN_MIN_Q12)
        return;
    forward = (below_half_mm * ahead_q12 - BALL_DIAMETER_MM * length_q12) / (2 * down_q12);
    /* Shadow, blur and another robot can lower the top, but nothing brings the ball nearer. */
    if (forward < NEAREST_MM)
        forward = NEAREST_MM;
    depth = (forward * CAMERA_TILT_COS_Q12 + below_mm * CAMERA_TILT_SIN_Q12) >> 12;
    ball->valid = 1;
    ball->forward_mm = (int16_t)(forward + LENS_FORWARD_MM);
    ball->left_mm =
        (int16_t)((((CAMERA_CX_Q4 - (int32_t)report->ball_x_q4) * depth / CAMERA_FOCAL_PX) -
                   CAMERA_RIGHT_LENS_MM_Q4) /
                  16);
    ball->sigma_mm = TOP_SIGMA_MM;
}

static void see_ball(const report_t *report, const soccer_tuning_t *tuning, sightings_t *sightings)
{
    place_t *ball = &sightings->ball;
    uint16_t x_px = report->ball_x_q4 / 16u;
    uint16_t half = report->ball_width_px / 2u;
    int cut = x_px < half + 3u || x_px + half + 3u > CAMERA_WIDTH_PX;

    if (!(report->flags & REPORT_BALL) || report->ball_width_px == 0)
        return;
    if (report->ball_disparity_q4 != 0) {
        int32_t off = (int32_t)place_by_disparity(tuning, ball, report->ball_x_q4, report->ball_row,
                                                  report->ball_disparity_q4) -
                      BALL_RADIUS_MM;

        /* Not on the floor: no ball. Under the tilt an error of the range is one of the height. */
        if (off < 0)
            off = -off;
        ball->valid = ball->valid && off < tuning->height_slack_mm + ball->sigma_mm;
        return;
    }
    if (!(report->flags & REPORT_BALL_CLIPPED)) {
        if (!cut)
            place_by_row(ball, report);
    } else if (2 * (int32_t)report->ball_row + report->ball_width_px > 2 * CUT_ROW) {
        place_by_top(ball, report);
    } else {
        place_by_row(ball, report);
    }
    if (report->flags & REPORT_BALL_LEFT_ONLY)
        ball->left_mm = (int16_t)(ball->left_mm + CAMERA_BASELINE_UM / 1000);
    /* Cut by the picture's side: the middle is a guess. */
    if (cut && ball->valid)
        ball->sigma_mm = NEAR_SIGMA_MM;
}

static void see_goal(const report_t *report, const soccer_tuning_t *tuning, sightings_t *sightings)
{
    static const uint16_t flag[2] = {REPORT_GOAL_LEFT_EDGE, REPORT_GOAL_RIGHT_EDGE};
    place_t *edge = sightings->goal_edge;
    uint32_t width;
    uint32_t slack;
    unsigned i;

    for (i = 0; i < 2; i++)
        if (report->flags & flag[i])
            (void)place_by_disparity(tuning, &edge[i], report->goal_x_q4[i], GOAL_ROW,
                                     report->goal_disparity_q4[i]);
    if (!edge[0].valid || !edge[1].valid)
        return;
    width = length_of(edge[0].forward_mm - edge[1].forward_mm, edge[0].left_mm - edge[1].left_mm);
    slack = GOAL_WIDTH_MM * (uint32_t)tuning->goal_width_slack_percent / 100u + edge[0].sigma_mm +
            edge[1].sigma_mm;
    if (width > GOAL_WIDTH_MM + slack || width + slack < GOAL_WIDTH_MM) {
        edge[0].valid = 0;
        edge[1].valid = 0;
    }
}

static void see_opponent(const report_t *report, const soccer_tuning_t *tuning,
                         sightings_t *sightings)
{
    place_t *opponent = &sightings->opponent;

    if (!(report->flags & REPORT_OPPONENT))
        return;
    (void)place_by_disparity(tuning, opponent, report->opponent_x_q4, OPPONENT_ROW,
                             report->opponent_disparity_q4);
    /* The eye sees the surface; the axis is a radius behind it. */
    if (opponent->valid)
        opponent->forward_mm = (int16_t)(opponent->forward_mm + OPPONENT_RADIUS_MM);
}

/* The foot of the wall lies on the floor: its row tells the range. The row is the first one of
 * the pitch: its upper edge. */
static void see_walls(const report_t *report, sightings_t *sightings)
{
    static const uint16_t columns[REPORT_WALL_COLUMNS] = {
        REPORT_WALL_COLUMN_LEFT, REPORT_WALL_COLUMN_CENTRE, REPORT_WALL_COLUMN_RIGHT};
    ground_point_t point;
    unsigned i;

    if (!(report->flags & REPORT_WALL))
        return;
    for (i = 0; i < REPORT_WALL_COLUMNS; i++)
        if (report->wall_row[i] != 0 &&
            depth_on_plane((uint16_t)(16u * columns[i]), (uint16_t)(16u * report->wall_row[i] - 8u),
                           0, &point) &&
            point.forward_mm < WALL_RANGE_MAX_MM)
            /* Half a row: range^2 / (f * 94 mm) / 2. */
            fill(&sightings->wall[i], &point,
                 (uint16_t)(2 + (int32_t)point.forward_mm * point.forward_mm /
                                    (CAMERA_FOCAL_PX * 2L * CAMERA_LENS_HEIGHT_MM)));
}

void sightings_from_report(const report_t *report, const soccer_tuning_t *tuning,
                           sightings_t *sightings)
{
    static const sightings_t nothing;

    *sightings = nothing;
    if (report->function != FPGA_FUNCTION_SOCCER || (report->flags & REPORT_FRAME_TORN))
        return;
    see_ball(report, tuning, sightings);
    see_goal(report, tuning, sightings);
    see_opponent(report, tuning, sightings);
    see_walls(report, sightings);
}
