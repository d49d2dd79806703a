#include "vision/robot_eye.h"

static uint8_t clamped(uint8_t value, uint8_t low, uint8_t high)
{
    if (value < low)
        return low;
    return value > high ? high : value;
}

void robot_eye_begin(robot_eye_t *eye, const eye_params_t *params)
{
    eye->params.goal_row = clamped(params->goal_row, 4, 235);
    eye->params.opponent_row = clamped(params->opponent_row, 4, 235);
    eye->params.search_max = clamped(params->search_max, 16, 127);
    ball_begin(&eye->ball);
}

void robot_eye_row(robot_eye_t *eye, uint8_t row, const uint16_t *left, const uint16_t *right)
{
    ball_row(&eye->ball, row, left, right);
}

void robot_eye_end(robot_eye_t *eye, report_t *report)
{
    static const report_t nothing = {0,      0, 0, 0,         0, 0, 0, 0, {0, 0},
                                     {0, 0}, 0, 0, {0, 0, 0}, 0, 0, 0, 0};

    *report = nothing;
    ball_end(&eye->ball, eye->params.search_max, report);
}
