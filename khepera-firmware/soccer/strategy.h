/* What to do: one step function from the world model to wheel speeds.
 *
 *   SEARCH    turn on the spot, first towards where the ball was last
 *   RELOCATE  nothing found in a turn: drive a little aside or back, look again
 *   LOOK      the ball is known but not the own place: turn until a goal has been seen
 *   APPROACH  drive around the ball to a pose behind it on the line of the shot
 *   PUSH      drive through the ball, along the line that ends in the goal
 *   DEFEND    the opponent is nearer to the ball: stand between ball and own goal, face the ball
 *   AWAIT     the ball is stuck: stand where the referee's free ball can be shot at once
 *   BACK_OFF  stuck: drive free, turn
 *
 * Each change of state has a reason, which is kept for whoever logs it. Without a sighting of the
 * ball the robot never drives towards the opponent's goal, and it never pushes towards its own.
 * Pure: no hardware, time as ticks of 10 ms. */
#ifndef SOCCER_STRATEGY_H
#define SOCCER_STRATEGY_H

#include <stdint.h>

#include "soccer/tuning.h"
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
    STRATEGY_DEFEND,
    STRATEGY_BACK_OFF,
    STRATEGY_AWAIT,
    STRATEGY_STATE_COUNT
} strategy_state_t;

/* Why a state was left: X(identifier, text). */
#define STRATEGY_REASONS(X)                                                                        \
    X(BALL_FOUND, "ball found")                                                                    \
    X(BALL_LOST, "ball lost")                                                                      \
    X(NOT_FOUND, "no ball in a whole turn")                                                        \
    X(VIEWPOINT, "viewpoint reached")                                                              \
    X(NO_VIEWPOINT, "viewpoint not reached in time")                                               \
    X(PLACE_UNKNOWN, "own place not known")                                                        \
    X(PLACE_KNOWN, "own place known")                                                              \
    X(NO_GOAL_SEEN, "no goal seen in time")                                                        \
    X(BEHIND_BALL, "behind the ball")                                                              \
    X(NEARLY_BEHIND, "as far behind the ball as walls let it")                                     \
    X(OFF_LINE, "off the line of the shot")                                                        \
    X(BALL_AWAY, "ball rolled away")                                                               \
    X(OPPONENT_NEARER, "opponent nearer to the ball")                                              \
    X(OPPONENT_FARTHER, "opponent no longer nearer to the ball")                                   \
    X(WHEELS_BLOCKED, "wheels do not turn as told")                                                \
    X(WALL, "wheels slip at a wall or at the opponent")                                            \
    X(NO_WAY, "no way to behind the ball")                                                         \
    X(STALEMATE, "ball stuck, a free ball must come")                                              \
    X(PLAY_ON, "ball plays again")                                                                 \
    X(TOO_LONG, "took too long")                                                                   \
    X(FREE, "driven free")

typedef enum {
#define STRATEGY_REASON(identifier, text) STRATEGY_##identifier,
    STRATEGY_REASONS(STRATEGY_REASON)
#undef STRATEGY_REASON
        STRATEGY_REASON_COUNT
} strategy_reason_t;

typedef struct {
    strategy_state_t from;
    strategy_state_t to;
    strategy_reason_t reason;
} strategy_event_t;

/* Changes of state kept until they are taken; older ones are lost, and counted. */
#define STRATEGY_EVENTS 8u

typedef struct {
    const soccer_tuning_t *tuning;
    strategy_event_t events[STRATEGY_EVENTS];
    uint8_t event_first;
    uint8_t event_count;
    uint16_t events_lost; /* saturates */
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
    int32_t still_x_q4; /* where the ball has been, within STILL_MM, */
    int32_t still_y_q4;
    uint16_t still_ticks; /* ... for so long as is known; saturates */
    uint8_t still_known;
    wheels_t wheels; /* the last answer */
} strategy_t;

/* `tuning` must outlive the strategy; what changes in it counts at the next decision. */
void strategy_start(strategy_t *strategy, const soccer_tuning_t *tuning);

/* A tick passes; counts: travel of the wheels in it (to notice that the robot is stuck). */
void strategy_tick(strategy_t *strategy, const int32_t counts[2]);

/* Decide: takes the world as it is now, changes state, fills *wheels. May forget the ball if it is
 * not where it should be. */
void strategy_decide(strategy_t *strategy, world_t *world, wheels_t *wheels);

/* The oldest change of state not yet taken: 1, or 0 if there is none. */
int strategy_take_event(strategy_t *strategy, strategy_event_t *event);

/* "search", "push"...; for humans. */
const char *strategy_state_name(strategy_state_t state);

/* "ball lost", "behind the ball"...; for humans. */
const char *strategy_reason_name(strategy_reason_t reason);

#endif
