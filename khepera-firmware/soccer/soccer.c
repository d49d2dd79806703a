#include "soccer/soccer.h"

#include "soccer/sighting.h"
#include "vision/camera.h"

#define BLIND_TURN_MM_S 30

void soccer_start(soccer_t *soccer, angle_t heading)
{
    world_start(&soccer->world, heading);
    strategy_start(&soccer->strategy);
    soccer->decided = 0;
    soccer->wheels.left_mm_s = 0;
    soccer->wheels.right_mm_s = 0;
}

void soccer_tick(soccer_t *soccer, const int32_t counts[2])
{
    world_tick(&soccer->world, counts);
    strategy_tick(&soccer->strategy, counts);
    /* Twice within one tick changes nothing but the processor's load. */
    if (!soccer->decided)
        strategy_decide(&soccer->strategy, &soccer->world, &soccer->wheels);
    soccer->decided = 0;
}

void soccer_see(soccer_t *soccer, const report_t *report, uint16_t age_100us)
{
    sightings_t sightings;

    sightings_from_report(report, &sightings);
    world_see(&soccer->world, &sightings,
              (uint32_t)age_100us + report->delay + CAMERA_EXPOSURE_TO_END_US / 100);
    strategy_decide(&soccer->strategy, &soccer->world, &soccer->wheels);
    soccer->decided = 1;
}

void soccer_wheels(const soccer_t *soccer, wheels_t *wheels)
{
    *wheels = soccer->wheels;
}

void soccer_search_blind(const soccer_t *soccer, wheels_t *wheels)
{
    wheels->left_mm_s = (int16_t)(soccer->strategy.turn * -BLIND_TURN_MM_S);
    wheels->right_mm_s = (int16_t)(soccer->strategy.turn * BLIND_TURN_MM_S);
}

const char *soccer_state_name(const soccer_t *soccer)
{
    return strategy_state_name(soccer->strategy.state);
}
