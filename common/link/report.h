/* The vision report: what the FPGA tells the 68331 base about one pair of frames.
 *
 * 32 bytes, big-endian, one per frame, clocked out over the turret bus (QSPI) after the attention
 * interrupt. docs/SPEC.md section 1 owns the layout and gives golden bytes.
 *
 * Coordinates are pixels of the 320x240 right image, (0,0) top left; disparity d = x_left - x_right
 * >= 0. The suffix _q4 means four fractional bits (1/16 px). A field whose flag is clear is 0. */
#ifndef LINK_REPORT_H
#define LINK_REPORT_H

#include <stdint.h>

#define REPORT_SIZE    32u
#define REPORT_VERSION 1u

/* The function the FPGA is configured with; low nibble of byte 0. */
#define FPGA_FUNCTION_NONE    0u
#define FPGA_FUNCTION_SOCCER  1u /* detectors and reports */
#define FPGA_FUNCTION_CAPTURE 2u /* raw frames and a test pattern only; never reports objects */

/* Bits of report_t.flags. */
#define REPORT_BALL               0x0001u /* ball seen by at least one eye */
#define REPORT_BALL_CLIPPED       0x0002u /* nearer than the search range: ball_disparity_q4 = 0 */
#define REPORT_BALL_RIGHT_ONLY    0x0004u /* ball_disparity_q4 = 0 */
#define REPORT_BALL_LEFT_ONLY     0x0008u /* ball_x_q4, row and width are those of the LEFT image */
#define REPORT_GOAL_LEFT_EDGE     0x0010u
#define REPORT_GOAL_RIGHT_EDGE    0x0020u
#define REPORT_OPPONENT           0x0040u
#define REPORT_WALL               0x0080u /* at least one of wall_row is valid */
#define REPORT_EXPOSURE_UNSETTLED 0x0100u
#define REPORT_FRAME_TORN         0x0200u

#define REPORT_WALL_COLUMNS       3u
/* The columns (right image) in which the foot of the wall is looked for. */
#define REPORT_WALL_COLUMN_LEFT   40u
#define REPORT_WALL_COLUMN_CENTRE 160u
#define REPORT_WALL_COLUMN_RIGHT  280u

typedef struct {
    uint8_t function;           /* FPGA_FUNCTION_* */
    uint8_t sequence;           /* one more for each frame, wraps */
    uint16_t flags;             /* REPORT_* */
    uint16_t exposure_time;     /* middle of the exposure, units of 100 us, wraps */
    uint16_t ball_x_q4;         /* centre of the ball */
    uint8_t ball_row;           /* its row */
    uint8_t ball_width_px;      /* its widest yellow strip, saturates at 255 */
    uint16_t ball_disparity_q4; /* 0 where clipped or seen by one eye only */
    uint16_t goal_x_q4[2];      /* left, right edge of the goal on the goal row */
    uint16_t goal_disparity_q4[2];
    uint16_t opponent_x_q4;                /* middle of the striped body on the opponent row */
    uint16_t opponent_disparity_q4;        /* of its nearest (matched) surface */
    uint8_t wall_row[REPORT_WALL_COLUMNS]; /* row of the wall's foot; 0 = not seen */
    uint8_t ball_confidence;               /* 0..255 */
    uint8_t goal_confidence;               /* 0..15 */
    uint8_t opponent_confidence;           /* 0..15 */
    uint8_t delay; /* end of frame to this report, units of 100 us, saturates */
} report_t;

typedef enum {
    REPORT_OK = 0,
    REPORT_BAD_CRC = -1,    /* damaged on the way, or nobody there (all ones or all zeros) */
    REPORT_BAD_VERSION = -2 /* whole, but of a version this side does not know */
} report_error_t;

/* Encode `report` into wire[0..31], CRC included. Nibble fields are cut to their range. */
void report_encode(const report_t *report, uint8_t wire[REPORT_SIZE]);

/* Decode wire[0..31]. On any error *report is left as it was.
 * May be called from an interrupt. */
report_error_t report_decode(const uint8_t wire[REPORT_SIZE], report_t *report);

#endif
