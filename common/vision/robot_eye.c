#include "vision/robot_eye.h"

#include "vision/goal.h"
#include "vision/opponent.h"

/* The state fits the FPGA's block RAM: a negative array size stops the compiler otherwise. */
typedef char robot_eye_fits_block_ram[sizeof(robot_eye_t) <= ROBOT_EYE_MAX_STATE ? 1 : -1];

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
    eye->params.yellow_margin = params->yellow_margin;
    ball_begin(&eye->ball, eye->params.yellow_margin);
    wall_begin(&eye->wall, eye->params.yellow_margin);
}

void robot_eye_row(robot_eye_t *eye, uint8_t row, const uint16_t *left, const uint16_t *right)
{
    ball_row(&eye->ball, row, left, right);
    wall_row(&eye->wall, row, right);
}

void robot_eye_end(robot_eye_t *eye, const frame_pair_t *frames, report_t *report)
{
    static const report_t nothing = {0,      0, 0, 0,         0, 0, 0, 0, {0, 0},
                                     {0, 0}, 0, 0, {0, 0, 0}, 0, 0, 0, 0};

    opponent_extent_t opponent;

    *report = nothing;
    ball_end(&eye->ball, frames, eye->params.search_max, report);
    band_load(&eye->band, frames, eye->params.opponent_row);
    opponent_find(&eye->band, eye->params.search_max, report, &opponent);
    band_load(&eye->band, frames, eye->params.goal_row);
    goal_find(&eye->band, eye->params.search_max, &opponent, report);
    wall_end(&eye->wall, &opponent, report);
}
