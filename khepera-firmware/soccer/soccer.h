/* Soccer: reports and wheel travel in, wheel speeds out.
 *
 * Pure state in fixed point, no hardware: the base calls it, and so do the tests on a PC. */
#ifndef SOCCER_SOCCER_H
#define SOCCER_SOCCER_H

#include <stdint.h>

#include "link/report.h"
#include "soccer/belief.h"
#include "soccer/strategy.h"
#include "soccer/tuning.h"
#include "soccer/world.h"

typedef struct {
    const soccer_tuning_t *tuning;
    soccer_belief_t belief; /* as of the last tick */
    world_t world;
    strategy_t strategy;
    wheels_t wheels;       /* as decided last */
    uint8_t since_ticks;   /* since then */
    uint16_t untold_ticks; /* since a report told of anything at all; saturates */
    uint16_t dark_ticks;   /* since then, or since nothing could be seen anyway; saturates */
} soccer_t;

/* Reports that tell of nothing for so long stop the motors, ticks of 10 ms; */
#define SOCCER_DARK_TICKS        19u
/* ... and for so long make it turn on the spot. */
#define SOCCER_DARK_SEARCH_TICKS 100u
/* So close before a wall or the opponent that he fills the picture, open eyes tell of nothing
 * either: believed for so long, then it turns on the spot. */
#define SOCCER_BLIND_SPOT_TICKS  100u

/* Once, before anything else. `tuning` must outlive `soccer`; what changes in it counts at once. */
void soccer_init(soccer_t *soccer, const soccer_tuning_t *tuning);

/* Kick-off: forget everything but the heading (0 = towards the opponent's goal, left positive). */
void soccer_start(soccer_t *soccer, angle_t heading);

/* A tick of 10 ms: travel of the wheels in encoder counts, [0] left, [1] right. Decides
 * anew if no report has made it do so for a while. */
void soccer_tick(soccer_t *soccer, const int32_t counts[2]);

/* A report whose attention interrupt came `age_100us` (units of 100 us) before the latest tick;
 * negative: after it, as is usual. Decides anew. */
void soccer_see(soccer_t *soccer, const report_t *report, int32_t age_100us);

/* The wheel speeds to drive with now. 0: the motors must be off, because for so long no report has
 * told of anything (dark eyes); after a second of that it turns on the spot. */
int soccer_wheels(const soccer_t *soccer, wheels_t *wheels);

/* The wheel speeds while no reports come: slowly on the spot. */
void soccer_search_blind(const soccer_t *soccer, wheels_t *wheels);

/* 1 if soccer_take_event() would give one. */
static inline int soccer_has_event(const soccer_t *soccer)
{
    return soccer->strategy.event_count > 0;
}

/* The oldest change of state not yet taken, with its reason: 1, or 0 if there is none. */
int soccer_take_event(soccer_t *soccer, strategy_event_t *event);

/* What it is doing, for humans. */
const char *soccer_state_name(const soccer_t *soccer);

#endif
