/* The foot of the wall: the row where grey wall (or black goal) meets the green pitch, in three
 * columns of the right image.
 *
 * While the rows stream by, each column watches the sum over WALL_COLUMNS pixels around it: a foot
 * is where, after at least wall_rows rows that are neither green nor yellow, as many of the next
 * rows are green. White lines on the pitch, the ball and the opponent's feet lie below it, or hide
 * it: then the column says nothing. Its distance: depth_on_plane with height 0.
 *
 * What the hardware would hold: three counters and a row number a column, no memory. */
#ifndef VISION_WALL_H
#define VISION_WALL_H

#include <stdint.h>

#include "link/registers.h"
#include "link/report.h"
#include "vision/opponent.h"

#define WALL_COLUMNS 5 /* pixels summed, centred on the column; at most 16 */

typedef struct {
    uint8_t row[REPORT_WALL_COLUMNS];    /* of the foot; 0: not found yet */
    uint8_t above[REPORT_WALL_COLUMNS];  /* rows of wall since the last thing that was not */
    uint8_t below[REPORT_WALL_COLUMNS];  /* green rows after them */
    uint8_t barred[REPORT_WALL_COLUMNS]; /* 1: something else came first */
    const eye_params_t *params;
} wall_finder_t;

/* Start a frame. `params` are used until its end. */
void wall_begin(wall_finder_t *finder, const eye_params_t *params);

/* Take the next row of the right eye, CAMERA_WIDTH_PX RGB565 pixels. */
void wall_row(wall_finder_t *finder, uint8_t row, const uint16_t *right);

/* Fill the wall's fields and flag of *report; columns that the opponent covers say nothing. */
void wall_end(const wall_finder_t *finder, const opponent_extent_t *opponent, report_t *report);

#endif
