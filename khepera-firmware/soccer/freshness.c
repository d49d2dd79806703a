#include "soccer/freshness.h"

#define TICK_100US    100u
/* Crystals differ: the offset may grow by 100 us each so many reports, 160 ppm. */
#define CREEP_REPORTS 25u

void freshness_init(freshness_t *freshness)
{
    static const freshness_t nothing;

    *freshness = nothing;
    freshness->quiet_ticks = UINT16_MAX;
}

void freshness_tick(freshness_t *freshness)
{
    freshness->now_100us = (uint16_t)(freshness->now_100us + TICK_100US);
    if (freshness->quiet_ticks < UINT16_MAX)
        freshness->quiet_ticks++;
}

static int16_t wrapped(uint16_t difference)
{
    return (int16_t)(difference < 0x8000u ? difference : (int32_t)difference - 65536L);
}

/* The offset is that of the quickest report; slowly forgotten. */
static void learn_offset(freshness_t *freshness, uint16_t offset, int16_t late)
{
    if (!freshness->known || late < 0 || late > FRESHNESS_LATE_100US) {
        freshness->offset_100us = offset;
        freshness->creep = 0;
    } else if (++freshness->creep >= CREEP_REPORTS) {
        freshness->offset_100us++;
        freshness->creep = 0;
    }
}

static int is_stale(const freshness_t *freshness, const report_t *report, int16_t late)
{
    uint8_t ahead = (uint8_t)(report->sequence - freshness->sequence);

    if (!freshness->known)
        return 0;
    if (ahead == 0)
        return 1;
    if (freshness->quiet_ticks < FRESHNESS_SEQUENCE_TICKS && ahead >= 0x80u)
        return 1;
    return late > FRESHNESS_LATE_100US && late < FRESHNESS_JUMP_100US &&
           freshness->quiet_ticks < FRESHNESS_RESYNC_TICKS;
}

int freshness_take(freshness_t *freshness, const report_t *report, uint16_t age_100us)
{
    uint16_t offset = (uint16_t)(freshness->now_100us - age_100us - report->exposure_time);
    int16_t late = wrapped((uint16_t)(offset - freshness->offset_100us));

    if (is_stale(freshness, report, late))
        return 0;
    learn_offset(freshness, offset, late);
    freshness->known = 1;
    freshness->sequence = report->sequence;
    freshness->quiet_ticks = 0;
    return 1;
}
