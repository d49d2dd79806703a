/* The stereo eye's geometry, in fixed point.
 *
 * Two parallel cameras; the RIGHT one is the reference of everything the robot computes. Pixel
 * (0,0) is top left, its centre has coordinates (0,0). A ray through (x, y) has the direction
 * ((x - cx) / f, (y - cy) / f, 1) in right, down, and along the optical axis. Disparity is
 * d = x_left - x_right >= 0.
 *
 * The numbers are a least-squares fit to the published reference scene (ball on the centre spot,
 * residuals <= 0.3 px), not a calibration of a real robot: a team that calibrates its own eye
 * changes them here, and firmware, FPGA and twin follow. */
#ifndef VISION_CAMERA_H
#define VISION_CAMERA_H

#include <stdint.h>

#define CAMERA_WIDTH_PX  320
#define CAMERA_HEIGHT_PX 240

/* Focal length, px at 320 px width: 52 degrees of horizontal field. */
#define CAMERA_FOCAL_PX 327
/* Principal point: the image's middle, 159.5 and 119.5 px. */
#define CAMERA_CX_Q4    2552
#define CAMERA_CY_Q4    1912

/* Baseline T: distance between the lenses. 50.4 mm; in 1/256 mm. */
#define CAMERA_BASELINE_UM       50400
#define CAMERA_BASELINE_MM_Q8    INT32_C(12902)
/* f * T = 16480.8 px mm; scaled so that dividing by a disparity in 1/16 px gives 1/16 mm. */
#define CAMERA_FOCAL_BASELINE_Q8 INT32_C(4219085)

/* Both lenses look 9.8 degrees down from 94 mm above the floor. */
#define CAMERA_TILT_SIN_Q12     697
#define CAMERA_TILT_COS_Q12     4036
#define CAMERA_LENS_HEIGHT_MM   94
/* The right lens is half a baseline (25.2 mm) to the right of the robot's middle. */
#define CAMERA_RIGHT_LENS_MM_Q4 403

/* From the middle of an exposure to the end of the frame's read-out, of both cameras: below the
 * frame period of 25 ms. An assumption until the cameras are measured. */
#define CAMERA_EXPOSURE_TO_END_US       20000L
/* The same at 640x480, below the frame period of 33 ms. */
#define CAMERA_EXPOSURE_TO_END_LARGE_US 28000L
/* Most frames a second at 640x480. */
#define CAMERA_LARGE_FRAME_RATE_MAX     30

/* Things on the pitch whose size the detectors rely on. */
#define BALL_DIAMETER_MM   67
#define GOAL_WIDTH_MM      300
#define OPPONENT_RADIUS_MM 30

#endif
