/* What to do: one step function from the world model to wheel speeds.
 *
 *   SEARCH    turn on the spot, first towards where the ball was last
 *   RELOCATE  nothing found in a turn: drive a little aside or back, look again
 *   LOOK      the ball is known but not the own place: turn until a goal has been seen
 *   APPROACH  drive around the ball to a pose behind it on the line of the shot
 *   PUSH      drive through the ball
 *   BACK_OFF  stuck: reverse, turn
 *
 * Without a sighting of the ball the robot never drives towards the opponent's goal. Pure: no
 * hardware, time as ticks of 10 ms. */
#ifndef SOCCER_STRATEGY_H
#define SOCCER_STRATEGY_H

#include <stdint.h>

#include "soccer/world.h"

typedef struct {
    int16_t left_mm_s;
    int16_t right_mm_s;
} wheels_t;

typedef enum {
    STRATEGY_SEARCH,
    STRATEGY_RELOCATE,
    STRATEGY_LOOK,
    STRATEGY_APPROACH,
    STRATEGY_PUSH,
    STRATEGY_BACK_OFF,
    STRATEGY_STATE_COUNT
} strategy_state_t;

typedef struct {
    strategy_state_t state;
    uint16_t state_ticks; /* in this state; saturates */
    uint16_t stuck_ticks; /* wheels do not turn as told */
    int8_t turn;          /* 1 left, -1 right: of SEARCH, LOOK and BACK_OFF */
    int8_t around;        /* way around the ball: 1, -1, 0 not chosen */
    int8_t escape;        /* of BACK_OFF: 1 forwards, -1 backwards */
    int8_t side;          /* of the next RELOCATE: 1 left, -1 right */
    uint8_t looked;       /* LOOK had its try */
    angle_t shot;         /* direction in which the ball shall go */
    uint8_t shot_known;
    uint8_t plan_ticks; /* since shot and way around were chosen; saturates */
    int32_t view_x_q4;  /* where RELOCATE drives to */
    int32_t view_y_q4;
    wheels_t wheels; /* the last answer */
} strategy_t;

void strategy_start(strategy_t *strategy);

/* A tick passes; counts: travel of the wheels in it (to notice that the robot is stuck). */
void strategy_tick(strategy_t *strategy, const int32_t counts[2]);

/* Decide: takes the world as it is now, changes state, fills *wheels. May forget the ball if it is
 * not where it should be. */
void strategy_decide(strategy_t *strategy, world_t *world, wheels_t *wheels);

/* "search", "push"...; for humans. */
const char *strategy_state_name(strategy_state_t state);

#endif
