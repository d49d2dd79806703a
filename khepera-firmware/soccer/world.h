/* The world model: where robot, ball and opponent are believed to be.
 *
 * Odometry carries the pose between sightings; goals and walls that are seen correct it
 * (soccer/own_place.h; which goal it is follows from the heading). Ball and opponent are kept in
 * field coordinates (soccer/odometry.h), so that they stay known while the robot looks elsewhere. A
 * report tells of the past: it is combined with the pose of the moment of its exposure. What is not
 * seen ages, and its place gets less certain.
 *
 * Pure state: time comes in as ticks of 10 ms. */
#ifndef SOCCER_WORLD_H
#define SOCCER_WORLD_H

#include <stdint.h>

#include "link/report.h"
#include "soccer/odometry.h"
#include "soccer/own_place.h"
#include "soccer/pitch.h"
#include "soccer/sighting.h"
#include "soccer/tuning.h"

#define BALL_RADIUS  34 /* mm, rounded up */
#define ROBOT_RADIUS 30 /* mm, both robots */

#define WORLD_HISTORY    12u /* poses kept, one a tick: 0.12 s */
#define WORLD_TICK_100US 100u

typedef struct {
    uint8_t known;
    uint8_t rolls;  /* it moved when it was last seen */
    uint8_t doubts; /* consecutive sightings that did not fit */
    int32_t x_q4;   /* mm, field */
    int32_t y_q4;
    int32_t vx_mm_s;
    int32_t vy_mm_s;
    int32_t sigma_q4;      /* standard deviation of its place as seen from the robot, mm */
    uint16_t age_ticks;    /* since it was last seen; saturates */
    uint16_t unseen_ticks; /* time it should have been in view and was not; saturates */
} object_t;

typedef struct {
    const soccer_tuning_t *tuning;
    odometry_t odometry;
    pose_t history[WORLD_HISTORY];
    uint8_t newest; /* index in history */
    own_place_t own;
    uint16_t wall_ticks; /* so long has odometry wanted to go through a wall or the
                          * opponent; saturates */
    object_t ball;
    object_t opponent;
    angle_t last_ball_bearing; /* direction (field) in which the ball was last seen */
} world_t;

/* A thing as seen from the robot's middle, now, with standard deviations. */
typedef struct {
    uint16_t range_mm;
    uint16_t range_sigma_mm;
    angle_t bearing; /* 0 = ahead, left positive */
    uint16_t bearing_sigma;
} sight_t;

/* Kick-off: heading known, place only to be in the own half. `tuning` must outlive the world; what
 * changes in it counts at once. */
void world_start(world_t *world, const soccer_tuning_t *tuning, angle_t heading);

/* One tick: travel of the wheels in encoder counts, [0] left, [1] right. */
void world_tick(world_t *world, const int32_t counts[2]);

/* Wheels have turned without the robot moving as they say: its place is less certain. */
void world_slipped(world_t *world);

/* What a report told, exposed `age_100us` before the latest tick. */
void world_see(world_t *world, const sightings_t *sightings, uint32_t age_100us);

/* Is a wall or the opponent believed to be so close before the eyes that they see nothing else? */
int world_view_is_blocked(const world_t *world);

/* Ball or opponent from where the robot is. Returns 0 with *sight untouched if it is not known. */
int world_sight(const world_t *world, const object_t *object, sight_t *sight);

/* The middle of a goal from where the robot is: side 1 = the opponent's, -1 = the own. Returns 0
 * with *sight untouched as long as the own place is not known. */
int world_sight_goal(const world_t *world, int side, sight_t *sight);

/* Standard deviation of the believed position, mm. */
uint16_t world_position_sigma_mm(const world_t *world);

#endif
