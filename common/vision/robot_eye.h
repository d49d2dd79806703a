/* The robot's eye: from a pair of frames to one vision report.
 *
 * This is the golden model of the FPGA's function `soccer`: begin, then each pair of rows from top
 * to bottom as the cameras deliver them, then end. It computes exactly what the hardware would, on
 * RGB565 and in integers. Not for interrupts: a frame takes a 68331 far longer than it has.
 *
 * What the hardware would hold: everything in robot_eye_t, below 16 KiB, which is what the
 * XCV300E's 32 block RAMs hold. At the end it reads at most ROBOT_EYE_MAX_ROW_READS rows back from
 * the frame memory. */
#ifndef VISION_ROBOT_EYE_H
#define VISION_ROBOT_EYE_H

#include <stdint.h>

#include "link/registers.h"
#include "link/report.h"
#include "vision/ball.h"
#include "vision/band.h"
#include "vision/camera.h"
#include "vision/wall.h"

typedef struct {
    eye_params_t params;
    ball_finder_t ball;
    wall_finder_t wall;
    band_t band; /* of the opponent's line, then of the goal's */
} robot_eye_t;

#define ROBOT_EYE_MAX_STATE 16384u

/* Both bands in both eyes, and the ball's outline in both. */
#define ROBOT_EYE_MAX_ROW_READS (2 * 2 * BAND_ROWS + 2 * BALL_MAX_ROWS)

/* Start a pair of frames. Parameters out of range are taken as the nearest one in range. *eye may
 * not be moved until its end. */
void robot_eye_begin(robot_eye_t *eye, const eye_params_t *params);

/* Take row 0, 1, ... 239 of both eyes, CAMERA_WIDTH_PX RGB565 pixels each. Rows may not be left
 * out. */
void robot_eye_row(robot_eye_t *eye, uint8_t row, const uint16_t *left, const uint16_t *right);

/* Finish: fill *report with what the pair shows. `frames` must hold the very rows that were taken.
 * sequence, exposure_time, delay and function are set to 0: they belong to whoever drives the eye.
 */
void robot_eye_end(robot_eye_t *eye, const frame_pair_t *frames, report_t *report);

#endif
