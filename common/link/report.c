#include "link/report.h"

#include "link/bytes.h"
#include "link/crc.h"

/* Offsets of the wire format; docs/SPEC.md section 1. */
enum {
    AT_VERSION = 0,
    AT_SEQUENCE = 1,
    AT_FLAGS = 2,
    AT_EXPOSURE = 4,
    AT_BALL_X = 6,
    AT_BALL_ROW = 8,
    AT_BALL_WIDTH = 9,
    AT_BALL_DISPARITY = 10,
    AT_GOAL_X = 12,
    AT_GOAL_DISPARITY = 16,
    AT_OPPONENT_X = 20,
    AT_OPPONENT_DISPARITY = 22,
    AT_WALL = 24,
    AT_BALL_CONFIDENCE = 27,
    AT_CONFIDENCES = 28,
    AT_DELAY = 29,
    AT_CRC = 30
};

void report_encode(const report_t *report, uint8_t wire[REPORT_SIZE])
{
    uint8_t i;

    wire[AT_VERSION] = (uint8_t)((REPORT_VERSION << 4) | (report->function & 0x0Fu));
    wire[AT_SEQUENCE] = report->sequence;
    be_put16(wire + AT_FLAGS, report->flags);
    be_put16(wire + AT_EXPOSURE, report->exposure_time);
    be_put16(wire + AT_BALL_X, report->ball_x_q4);
    wire[AT_BALL_ROW] = report->ball_row;
    wire[AT_BALL_WIDTH] = report->ball_width_px;
    be_put16(wire + AT_BALL_DISPARITY, report->ball_disparity_q4);
    for (i = 0; i < 2; i++) {
        be_put16(wire + AT_GOAL_X + 2 * i, report->goal_x_q4[i]);
        be_put16(wire + AT_GOAL_DISPARITY + 2 * i, report->goal_disparity_q4[i]);
    }
    be_put16(wire + AT_OPPONENT_X, report->opponent_x_q4);
    be_put16(wire + AT_OPPONENT_DISPARITY, report->opponent_disparity_q4);
    for (i = 0; i < REPORT_WALL_COLUMNS; i++)
        wire[AT_WALL + i] = report->wall_row[i];
    wire[AT_BALL_CONFIDENCE] = report->ball_confidence;
    wire[AT_CONFIDENCES] = (uint8_t)((uint8_t)((report->goal_confidence & 0x0Fu) << 4) |
                                     (report->opponent_confidence & 0x0Fu));
    wire[AT_DELAY] = report->delay;
    be_put16(wire + AT_CRC, crc16_ccitt(CRC16_INIT, wire, AT_CRC));
}

report_error_t report_decode(const uint8_t wire[REPORT_SIZE], report_t *report)
{
    uint8_t i;

    if (be_get16(wire + AT_CRC) != crc16_ccitt(CRC16_INIT, wire, AT_CRC))
        return REPORT_BAD_CRC;
    if (wire[AT_VERSION] >> 4 != REPORT_VERSION)
        return REPORT_BAD_VERSION;

    report->function = wire[AT_VERSION] & 0x0Fu;
    report->sequence = wire[AT_SEQUENCE];
    report->flags = be_get16(wire + AT_FLAGS);
    report->exposure_time = be_get16(wire + AT_EXPOSURE);
    report->ball_x_q4 = be_get16(wire + AT_BALL_X);
    report->ball_row = wire[AT_BALL_ROW];
    report->ball_width_px = wire[AT_BALL_WIDTH];
    report->ball_disparity_q4 = be_get16(wire + AT_BALL_DISPARITY);
    for (i = 0; i < 2; i++) {
        report->goal_x_q4[i] = be_get16(wire + AT_GOAL_X + 2 * i);
        report->goal_disparity_q4[i] = be_get16(wire + AT_GOAL_DISPARITY + 2 * i);
    }
    report->opponent_x_q4 = be_get16(wire + AT_OPPONENT_X);
    report->opponent_disparity_q4 = be_get16(wire + AT_OPPONENT_DISPARITY);
    for (i = 0; i < REPORT_WALL_COLUMNS; i++)
        report->wall_row[i] = wire[AT_WALL + i];
    report->ball_confidence = wire[AT_BALL_CONFIDENCE];
    report->goal_confidence = wire[AT_CONFIDENCES] >> 4;
    report->opponent_confidence = wire[AT_CONFIDENCES] & 0x0Fu;
    report->delay = wire[AT_DELAY];
    return REPORT_OK;
}
