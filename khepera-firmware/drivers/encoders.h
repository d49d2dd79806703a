/* The wheels' encoders: one count for each edge of channel A, 12 per mm of travel.
 *
 * Each edge interrupts (input capture, highest level in use). Rolling forward, channel B differs
 * from A right after the edge; it is read in the interrupt, so an edge served later than half an
 * edge's period counts in the wrong direction: see access_mask(). */
#ifndef DRIVERS_ENCODERS_H
#define DRIVERS_ENCODERS_H

#include <stdint.h>

void encoders_init(void);

/* Counts since start, forward positive, wrapping; [0] left, [1] right. */
void encoders_read(int32_t counts[2]);

#endif
