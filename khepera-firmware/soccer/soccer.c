#include "soccer/soccer.h"

#include "soccer/sighting.h"
#include "vision/camera.h"

/* Without a report it decides so often: reports come each 2.5 ticks, and more often than that the
 * wheels cannot follow. */
#define DECIDE_TICKS 4u

/* Open eyes see at least the foot of a wall, or what hides it, unless that is right before them. */
#define TELLS_SOMETHING                                                                            \
    (REPORT_BALL | REPORT_GOAL_LEFT_EDGE | REPORT_GOAL_RIGHT_EDGE | REPORT_OPPONENT | REPORT_WALL)

void soccer_init(soccer_t *soccer, const soccer_tuning_t *tuning)
{
    static const soccer_t nothing;

    *soccer = nothing;
    soccer->tuning = tuning;
    soccer->belief.version = SOCCER_BELIEF_VERSION;
    soccer_start(soccer, 0);
}

void soccer_start(soccer_t *soccer, angle_t heading)
{
    world_start(&soccer->world, soccer->tuning, heading);
    strategy_start(&soccer->strategy, soccer->tuning);
    soccer->since_ticks = 0;
    soccer->dark_ticks = 0;
    soccer->untold_ticks = 0;
    soccer->wheels.left_mm_s = 0;
    soccer->wheels.right_mm_s = 0;
}

static void count_up(uint16_t *ticks)
{
    if (*ticks < UINT16_MAX)
        (*ticks)++;
}

static void decide(soccer_t *soccer)
{
    strategy_decide(&soccer->strategy, &soccer->world, &soccer->wheels);
    soccer->since_ticks = 0;
}

static void tell_belief(soccer_t *soccer)
{
    const world_t *world = &soccer->world;
    soccer_belief_t *belief = &soccer->belief;
    pose_t pose;

    odometry_pose(&world->odometry, &pose);
    belief->state = (int32_t)soccer->strategy.state;
    belief->x_q4 = pose.x_q4;
    belief->y_q4 = pose.y_q4;
    belief->heading = pose.heading;
    belief->localised = world->own.localised;
    belief->ball_known = world->ball.known;
    belief->ball_x_q4 = world->ball.x_q4;
    belief->ball_y_q4 = world->ball.y_q4;
    belief->ball_age_ticks = world->ball.age_ticks;
    belief->opponent_known = world->opponent.known;
    belief->opponent_x_q4 = world->opponent.x_q4;
    belief->opponent_y_q4 = world->opponent.y_q4;
    belief->opponent_age_ticks = world->opponent.age_ticks;
    belief->ball_sigma_q4 = world->ball.sigma_q4;
    belief->opponent_sigma_q4 = world->opponent.sigma_q4;
    belief->position_var_mm2 =
        world->own.position_var[world->own.position_var[1] > world->own.position_var[0]];
    belief->ticks++;
}

void soccer_tick(soccer_t *soccer, const int32_t counts[2])
{
    world_tick(&soccer->world, counts);
    strategy_tick(&soccer->strategy, counts);
    count_up(&soccer->dark_ticks);
    count_up(&soccer->untold_ticks);
    /* Wheels that do not obey the strategy are not stuck. */
    if (soccer->dark_ticks >= SOCCER_DARK_TICKS)
        soccer->strategy.stuck_ticks = 0;
    if (++soccer->since_ticks >= DECIDE_TICKS)
        decide(soccer);
    tell_belief(soccer);
}

void soccer_see(soccer_t *soccer, const report_t *report, int32_t age_100us)
{
    sightings_t sightings;
    int32_t exposed_100us = age_100us + report->delay + CAMERA_EXPOSURE_TO_END_US / 100;

    if (report->flags & TELLS_SOMETHING)
        soccer->untold_ticks = 0;
    if (soccer->untold_ticks == 0)
        soccer->dark_ticks = 0;
    else if (world_view_is_blocked(&soccer->world))
        soccer->dark_ticks =
            soccer->untold_ticks < SOCCER_BLIND_SPOT_TICKS ? 0 : SOCCER_DARK_SEARCH_TICKS;
    sightings_from_report(report, soccer->tuning, &sightings);
    world_see(&soccer->world, &sightings, exposed_100us > 0 ? (uint32_t)exposed_100us : 0);
    decide(soccer);
}

int soccer_wheels(const soccer_t *soccer, wheels_t *wheels)
{
    if (soccer->dark_ticks >= SOCCER_DARK_SEARCH_TICKS)
        soccer_search_blind(soccer, wheels);
    else
        *wheels = soccer->wheels;
    return soccer->dark_ticks < SOCCER_DARK_TICKS || soccer->dark_ticks >= SOCCER_DARK_SEARCH_TICKS;
}

void soccer_search_blind(const soccer_t *soccer, wheels_t *wheels)
{
    wheels->left_mm_s = (int16_t)(-soccer->strategy.turn * soccer->tuning->blind_turn_mm_s);
    wheels->right_mm_s = (int16_t)(soccer->strategy.turn * soccer->tuning->blind_turn_mm_s);
}

int soccer_take_event(soccer_t *soccer, strategy_event_t *event)
{
    return strategy_take_event(&soccer->strategy, event);
}

const char *soccer_state_name(const soccer_t *soccer)
{
    return strategy_state_name(soccer->strategy.state);
}
