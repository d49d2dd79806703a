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

static int is_ahead(uint8_t sequence, uint8_t of)
{
    uint8_t ahead = (uint8_t)(sequence - of);

    return ahead != 0 && ahead < 0x80u;
}

/* The offset is that of the quickest report; slowly forgotten. */
static void learn_offset(freshness_t *freshness, uint16_t offset, int16_t late)
{
    if (late < 0 || late > FRESHNESS_LATE_100US) {
        freshness->offset_100us = offset;
        freshness->creep = 0;
    } else if (++freshness->creep >= CREEP_REPORTS) {
        freshness->offset_100us++;
        freshness->creep = 0;
    }
}

/* The turret's clock seems to have jumped. Believed when a second report, following the first, says
 * the same: old ones that come again do not. */
static int confirms_jump(freshness_t *freshness, uint8_t sequence, uint16_t offset)
{
    int16_t apart = wrapped((uint16_t)(offset - freshness->jump_offset_100us));
    int confirmed = freshness->jump_seen && is_ahead(sequence, freshness->jump_sequence) &&
                    apart < FRESHNESS_JITTER_100US && apart > -FRESHNESS_JITTER_100US;

    freshness->jump_seen = 1;
    freshness->jump_sequence = sequence;
    freshness->jump_offset_100us = offset;
    return confirmed;
}

static int is_news(freshness_t *freshness, const report_t *report, uint16_t offset, int16_t late)
{
    if (!freshness->known)
        return 1;
    if (report->sequence == freshness->sequence)
        return 0;
    if (late <= FRESHNESS_LATE_100US && late >= -FRESHNESS_LATE_100US)
        return freshness->quiet_ticks >= FRESHNESS_SEQUENCE_TICKS ||
               is_ahead(report->sequence, freshness->sequence);
    if (late > 0 && late < FRESHNESS_JUMP_100US && freshness->quiet_ticks < FRESHNESS_RESYNC_TICKS)
        return 0;
    return confirms_jump(freshness, report->sequence, offset);
}

int freshness_take(freshness_t *freshness, const report_t *report, uint16_t age_100us)
{
    uint16_t offset = (uint16_t)(freshness->now_100us - age_100us - report->exposure_time);
    int16_t late =
        freshness->known ? wrapped((uint16_t)(offset - freshness->offset_100us)) : (int16_t)-1;

    if (!is_news(freshness, report, offset, late))
        return 0;
    learn_offset(freshness, offset, late);
    freshness->known = 1;
    freshness->jump_seen = 0;
    freshness->sequence = report->sequence;
    freshness->quiet_ticks = 0;
    return 1;
}
