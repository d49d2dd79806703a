/* From a vision report to places in the robot's frame.
 *
 * The robot's frame: forward and left of the middle between the wheels, mm. Each place comes with
 * the standard deviation of its range, which grows with the square of the distance. Pure functions
 * of the report; the geometry is common/vision's. */
#ifndef SOCCER_SIGHTING_H
#define SOCCER_SIGHTING_H

#include <stdint.h>

#include "link/report.h"
#include "soccer/tuning.h"

typedef struct {
    uint8_t valid;
    int16_t forward_mm;
    int16_t left_mm;
    uint16_t sigma_mm; /* of the range, 1 standard deviation */
} place_t;

typedef struct {
    place_t ball;                      /* its middle */
    place_t goal_edge[2];              /* [0] left, [1] right in the image */
    place_t opponent;                  /* its axis */
    place_t wall[REPORT_WALL_COLUMNS]; /* the foot of the wall, from left to right */
} sightings_t;

/* Take a report apart. Implausible things (a ball not on the floor, a goal of the wrong width) are
 * left out. */
void sightings_from_report(const report_t *report, const soccer_tuning_t *tuning,
                           sightings_t *sightings);

#endif
