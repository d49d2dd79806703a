/* The ball: the largest yellow strip, in both eyes.
 *
 * What the hardware would hold: the best run of each eye. */
#ifndef VISION_BALL_H
#define VISION_BALL_H

#include <stdint.h>

#include "link/report.h"

typedef struct {
    uint16_t first[2]; /* the widest yellow run of the left (0) and right (1) eye */
    uint16_t length[2];
    uint8_t row[2];
} ball_finder_t;

void ball_begin(ball_finder_t *finder);
void ball_row(ball_finder_t *finder, uint8_t row, const uint16_t *left, const uint16_t *right);
void ball_end(const ball_finder_t *finder, uint8_t search_max, report_t *report);

#endif
