#include "vision/robot_eye.h"

#include "vision/goal.h"
#include "vision/opponent.h"

/* The state fits the FPGA's block RAM: a negative array size stops the compiler otherwise. */
typedef char robot_eye_fits_block_ram[sizeof(robot_eye_t) <= ROBOT_EYE_MAX_STATE ? 1 : -1];

void robot_eye_begin(robot_eye_t *eye, const eye_params_t *params)
{
    eye->params = *params;
    eye_params_clamp(&eye->params);
    ball_begin(&eye->ball, &eye->params);
    wall_begin(&eye->wall, &eye->params);
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
    ball_end(&eye->ball, frames, report);
    band_load(&eye->band, frames, eye->params.opponent_row, &eye->params);
    opponent_find(&eye->band, &eye->params, report, &opponent);
    band_load(&eye->band, frames, eye->params.goal_row, &eye->params);
    goal_find(&eye->band, &eye->params, &opponent, report);
    wall_end(&eye->wall, &opponent, report);
}
