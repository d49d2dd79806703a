#include "vision/ball.h"

#include "vision/camera.h"
#include "vision/color.h"

#define LEFT       0
#define RIGHT      1
#define MIN_RUN_PX 6u

void ball_begin(ball_finder_t *finder)
{
    static const ball_finder_t nothing = {{0, 0}, {0, 0}, {0, 0}};

    *finder = nothing;
}

static void keep_widest(ball_finder_t *finder, int eye, uint8_t row, const uint16_t *pixels)
{
    uint16_t run = 0;
    uint16_t x;

    for (x = 0; x < CAMERA_WIDTH_PX; x++) {
        run = color_is_yellow(pixels[x]) ? (uint16_t)(run + 1) : 0;
        if (run > finder->length[eye]) {
            finder->length[eye] = run;
            finder->first[eye] = (uint16_t)(x + 1 - run);
            finder->row[eye] = row;
        }
    }
}

void ball_row(ball_finder_t *finder, uint8_t row, const uint16_t *left, const uint16_t *right)
{
    keep_widest(finder, LEFT, row, left);
    keep_widest(finder, RIGHT, row, right);
}

/* Middle of the run, in 1/16 px. */
static uint16_t centre_q4(const ball_finder_t *finder, int eye)
{
    return (uint16_t)(16 * finder->first[eye] + 8 * (finder->length[eye] - 1));
}

void ball_end(const ball_finder_t *finder, uint8_t search_max, report_t *report)
{
    int in_left = finder->length[LEFT] >= MIN_RUN_PX;
    int in_right = finder->length[RIGHT] >= MIN_RUN_PX;
    int eye = in_right ? RIGHT : LEFT;
    int d_q4;

    if (!in_left && !in_right)
        return;
    report->flags |= REPORT_BALL;
    report->ball_x_q4 = centre_q4(finder, eye);
    report->ball_row = finder->row[eye];
    report->ball_width_px = (uint8_t)(finder->length[eye] > 255 ? 255 : finder->length[eye]);
    report->ball_confidence = 128;
    if (!in_left || !in_right) {
        report->flags |= in_right ? REPORT_BALL_RIGHT_ONLY : REPORT_BALL_LEFT_ONLY;
        return;
    }
    d_q4 = centre_q4(finder, LEFT) - centre_q4(finder, RIGHT);
    if (d_q4 > 16 * search_max)
        report->flags |= REPORT_BALL_CLIPPED;
    else if (d_q4 > 0)
        report->ball_disparity_q4 = (uint16_t)d_q4;
    else
        report->flags |= REPORT_BALL_RIGHT_ONLY;
}
