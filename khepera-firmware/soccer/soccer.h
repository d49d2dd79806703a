/* Soccer: reports and wheel travel in, wheel speeds out.
 *
 * Pure state in fixed point, no hardware: the base calls it, and so do the tests on a PC. */
#ifndef SOCCER_SOCCER_H
#define SOCCER_SOCCER_H

#include <stdint.h>

#include "link/report.h"
#include "soccer/strategy.h"
#include "soccer/world.h"

typedef struct {
    world_t world;
    strategy_t strategy;
    wheels_t wheels; /* as decided last */
    uint8_t decided; /* since the last tick */
} soccer_t;

/* Kick-off: forget everything but the heading (0 = towards the opponent's goal, left positive). */
void soccer_start(soccer_t *soccer, angle_t heading);

/* A tick of 10 ms: travel of the wheels in encoder counts, [0] left, [1] right. Decides
 * anew, unless a report made it do so since the last tick. */
void soccer_tick(soccer_t *soccer, const int32_t counts[2]);

/* A report whose attention interrupt came `age_100us` (units of 100 us) ago. Decides anew. */
void soccer_see(soccer_t *soccer, const report_t *report, uint16_t age_100us);

/* The wheel speeds decided last. */
void soccer_wheels(const soccer_t *soccer, wheels_t *wheels);

/* The wheel speeds while no reports come: slowly on the spot. */
void soccer_search_blind(const soccer_t *soccer, wheels_t *wheels);

/* What it is doing, for humans. */
const char *soccer_state_name(const soccer_t *soccer);

#endif
