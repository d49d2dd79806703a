/* Is a report news? Told apart by its sequence number and by the turret's clock in it.
 *
 * The turret stamps each report with the time of its exposure, on a clock of its own. The smallest
 * difference to the base's clock that has been seen is the time a report takes at best; what takes
 * much longer was held up, what is older than the last one came out of order. Pure state; time
 * comes in as ticks of 10 ms. */
#ifndef SOCCER_FRESHNESS_H
#define SOCCER_FRESHNESS_H

#include <stdint.h>

#include "link/report.h"

/* A report that came so much later than it could is stale; units of 100 us. */
#define FRESHNESS_LATE_100US     1000
/* The turret's clock has jumped (it was configured anew) if reports seem late by more than this,
 * or for so many ticks. */
#define FRESHNESS_JUMP_100US     20000
#define FRESHNESS_RESYNC_TICKS   300u
/* Reports after a jump agree on the new offset within this. */
#define FRESHNESS_JITTER_100US   400
/* Without a fresh report for so long, sequence numbers may begin anew. */
#define FRESHNESS_SEQUENCE_TICKS 20u

typedef struct {
    uint16_t now_100us;    /* the base's clock, wraps */
    uint16_t offset_100us; /* base's minus turret's at the quickest report */
    uint16_t quiet_ticks;  /* since the last fresh report; saturates */
    uint8_t sequence;
    uint8_t creep;     /* reports since the offset was last let grow */
    uint8_t known;     /* there has been a report */
    uint8_t jump_seen; /* the last report seemed to come after a jump of the turret's clock: */
    uint8_t jump_sequence;
    uint16_t jump_offset_100us;
} freshness_t;

void freshness_init(freshness_t *freshness);

/* Each 10 ms, whatever else happens. */
void freshness_tick(freshness_t *freshness);

/* A whole report whose attention interrupt came `age_100us` ago: 1 if it is news, 0 if it repeats
 * an old one, came after a newer one, or was held up. */
int freshness_take(freshness_t *freshness, const report_t *report, uint16_t age_100us);

#endif
