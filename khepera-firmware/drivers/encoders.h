/* The wheels' encoders: one count for each edge of channel A, 12 per mm of travel.
 *
 * A wheel is counted in one of two ways, and changes between them without losing a count:
 *
 *   by edges   each edge interrupts (input capture, highest level in use), and B then tells its
 *              direction. Rolling forward, channel B differs from A right after the edge; an edge
 *              served later than half an edge's period counts in the wrong direction: see
 *              access_mask(). Exact whatever the wheel does, and 200 clocks an edge.
 *   by pulses  a counter of the GPT counts A's rising edges, and nobody is interrupted. It does not
 *              know directions, so this is only for a wheel that cannot turn back before the next
 *              look at it: it is brisk, and its motor does not drive it the other way; or so fast
 *              that no motor could turn it back in that time.
 *
 * A wheel counted by pulses that something else than its motor turns back (a blow that drives gears
 * of 25:1 backwards) is told wrong until the next look, by what it rolls back in that time. */
#ifndef DRIVERS_ENCODERS_H
#define DRIVERS_ENCODERS_H

#include <stdint.h>

/* Call once, after tick_init(), interrupts still masked. */
void encoders_init(void);

/* Counts since start, forward positive, wrapping; [0] left, [1] right. Call it each tick: the
 * counters wrap after 256 rising edges, 42 ms at 1 m/s, and speeds are taken from call to call. */
void encoders_read(int32_t counts[2]);

/* What the motors are given from now on, -255..255, forward positive. */
void encoders_driven(int16_t left, int16_t right);

#endif
