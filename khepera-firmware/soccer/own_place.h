/* How well the robot knows its own pose, and what a sighting of goal or walls corrects.
 *
 * A Kalman filter of three numbers (x, y, heading) whose correlations are left out. Odometry makes
 * them uncertain; the two posts of a goal and the foot of the wall in three columns of the picture
 * make them certain again: posts are known points, a wall is a known line. What contradicts the
 * belief again and again makes it doubtful, until a whole goal sets it anew.
 *
 * Pure state. Angles in 1/65536 turn; field and pose as in soccer/odometry.h. */
#ifndef SOCCER_OWN_PLACE_H
#define SOCCER_OWN_PLACE_H

#include <stdint.h>

#include "soccer/odometry.h"
#include "soccer/sighting.h"
#include "soccer/tuning.h"

typedef struct {
    int32_t position_var[2]; /* of x and of y, mm^2 */
    int32_t heading_var;     /* (1/65536 turn)^2 / 16 */
    int32_t travel_rest;     /* counts not yet turned into variance */
    int32_t spin_rest;
    uint8_t doubts;    /* sightings in a row that did not fit */
    uint8_t localised; /* a goal or walls have told the place since the start */
} own_place_t;

/* Kick-off: heading known to a degree, place only to be in the own half. */
void own_place_start(own_place_t *own, const soccer_tuning_t *tuning);

/* A tick: travel of the wheels in encoder counts, [0] left, [1] right. */
void own_place_travel(own_place_t *own, const int32_t counts[2]);

/* The robot may have moved otherwise than its wheels: so much is added to the variances. */
void own_place_blur(own_place_t *own, int32_t position_var, int32_t heading_var);

/* The posts of a goal, seen from `then`, a belief of the past. Returns 1 with *change = what must
 * be added to the pose, or 0 if they tell nothing. */
int own_place_see_goal(own_place_t *own, const soccer_tuning_t *tuning, const place_t edge[2],
                       const pose_t *then, pose_t *change);

/* The foot of the wall in three columns, likewise. */
int own_place_see_walls(own_place_t *own, const soccer_tuning_t *tuning,
                        const place_t wall[REPORT_WALL_COLUMNS], const pose_t *then,
                        pose_t *change);

#endif
