/* Every number of world model and strategy that a team may want to change.
 *
 * SOCCER_TUNING(X) expands X(name, unit, default, min, max, text) once for each. The name carries
 * the unit as its suffix, every value is an int16_t between min and max (both included), and a
 * change takes effect at the next decision. The console's parameter table, the defaults and the
 * structure below are all expanded from this list. */
#ifndef SOCCER_TUNING_H
#define SOCCER_TUNING_H

#include <stdint.h>

/* clang-format off */
#define SOCCER_TUNING(X) \
    /* World model: what the eyes' answers are worth. */ \
    X(disparity_sigma_q4, "1/16 px", 4, 1, 64, "standard deviation of a disparity") \
    X(height_slack_mm, "mm", 30, 5, 200, "a ball so far off the floor is none") \
    X(goal_width_slack_percent, "%", 15, 1, 100, "a goal of a width so far off is none") \
    X(ball_gate_mm, "mm", 60, 10, 500, "a jump of the ball beyond that, and 3 sigma, is doubted") \
    X(opponent_gate_mm, "mm", 60, 10, 500, "the same for the opponent") \
    X(ball_drift_mm_s, "mm/s", 150, 0, 2000, "an unseen ball gets so much less certain") \
    X(opponent_drift_mm_s, "mm/s", 200, 0, 2000, "the same for the opponent") \
    X(speed_gain_q8, "1/256", 32, 0, 256, "share of a sighting's surprise that is taken for speed") \
    X(doubts_max, "sightings", 3, 1, 50, "so many doubted ones in a row are believed") \
    X(wall_slack_mm, "mm", 40, 0, 300, "a thing so far beyond the wall is none") \
    X(ball_slowing_mm_s2, "mm/s2", 200, 0, 2000, "what a rolling ball loses") \
    X(kick_off_sigma_mm, "mm", 220, 10, 1000, "how well the place is known at kick-off") \
    X(localised_sigma_mm, "mm", 60, 10, 500, "the place counts as known below that") \
    X(ball_unseen_ms, "ms", 350, 20, 10000, "a ball not where it should be for so long is lost") \
    X(ball_forget_ms, "ms", 1500, 100, 30000, "a ball out of view for so long is lost") \
    X(opponent_unseen_ms, "ms", 600, 20, 10000, "the same as ball_unseen_ms, of the opponent") \
    X(opponent_forget_ms, "ms", 4000, 100, 30000, "the same as ball_forget_ms, of the opponent") \
    /* Speeds of the robot's middle; of turning: of each wheel. */ \
    X(search_turn_mm_s, "mm/s", 150, 5, 160, "turning to search or to look for a goal") \
    X(blind_turn_mm_s, "mm/s", 30, 0, 110, "turning while no reports come") \
    X(relocate_mm_s, "mm/s", 100, 20, 500, "driving to another place to search from") \
    X(approach_mm_s, "mm/s", 420, 20, 500, "driving to behind the ball") \
    X(push_mm_s, "mm/s", 420, 20, 500, "driving through the ball") \
    X(defend_mm_s, "mm/s", 420, 20, 500, "driving to between ball and own goal") \
    X(back_off_mm_s, "mm/s", 140, 20, 500, "getting free") \
    X(turn_max_mm_s, "mm/s", 160, 10, 300, "turning at most") \
    /* Times. */ \
    X(plan_ms, "ms", 50, 10, 1000, "the shot is chosen anew so often") \
    X(search_ms, "ms", 4000, 500, 30000, "search in one place") \
    X(relocate_ms, "ms", 2500, 100, 30000, "drive to another at most") \
    X(look_ms, "ms", 4000, 0, 30000, "look for a goal at most") \
    X(push_blind_ms, "ms", 500, 20, 10000, "push on without seeing the ball") \
    X(approach_ms, "ms", 12000, 500, 30000, "an approach that lasts longer is stuck") \
    X(push_ms, "ms", 5000, 200, 30000, "a push that lasts longer is stuck") \
    X(stuck_ms, "ms", 400, 50, 5000, "wheels that turn too little for so long are stuck") \
    X(stuck_percent, "%", 25, 5, 90, "wheels that turn less than that of what was told") \
    X(back_off_ms, "ms", 450, 50, 5000, "drive free for") \
    X(back_off_turn_ms, "ms", 250, 0, 5000, "and then turn for") \
    X(pinned_ball_ms, "ms", 1500, 200, 30000, "a still ball at the opponent is stuck") \
    X(stuck_ball_ms, "ms", 7000, 500, 30000, "any still ball is") \
    X(await_ms, "ms", 11000, 500, 30000, "wait for a free ball at most") \
    /* Distances, between middles. */ \
    X(behind_mm, "mm", 115, 65, 300, "behind the ball a push begins") \
    X(around_mm, "mm", 122, 70, 300, "radius of the way around the ball") \
    X(push_lost_mm, "mm", 330, 100, 1000, "a ball so far ahead is no longer pushed") \
    X(goal_aim_mm, "mm", 100, 10, 150, "half the goal's width that a shot aims at") \
    X(opponent_clear_mm, "mm", 90, 60, 300, "a way passes the opponent at least so far off") \
    X(shot_clear_mm, "mm", 80, 30, 300, "so does the line of a shot") \
    X(opponent_fresh_ms, "ms", 1500, 20, 10000, "an opponent seen so lately counts for defence") \
    X(defend_ball_mm, "mm", 150, 70, 600, "so far from the ball it defends") \
    X(defend_behind_deg, "deg", 60, 10, 180, "nearer than that to behind the ball it attacks") \
    X(await_mm, "mm", 140, 60, 400, "wait so far behind the free ball's spot") \
    X(contest_mm, "mm", 250, 0, 1500, "an opponent so near to the ball contests it") \
    X(shot_outside, "1/4", 6, 0, 100, "cost of a shot's angle beside the goal") \
    X(shot_way, "1/16", 8, 0, 100, "cost of the angle to be driven around the ball") \
    X(contest_outside, "1/4", 4, 0, 100, "cost of a contested shot's angle beside the goal") \
    X(contest_way, "1/16", 8, 0, 100, "cost of the angle around a contested ball") \
    X(defend_margin_mm, "mm", 120, 0, 1000, "defend if the opponent is nearer to the ball by that") \
    /* Angles. */ \
    X(push_begin_deg, "deg", 30, 1, 45, "off the shot's line when a push begins") \
    X(push_end_deg, "deg", 60, 5, 90, "off the line so much a push ends")
/* clang-format on */

struct soccer_tuning_t {
#define SOCCER_TUNING_FIELD(name, unit, normal, min, max, text) int16_t name;
    SOCCER_TUNING(SOCCER_TUNING_FIELD)
#undef SOCCER_TUNING_FIELD
};
typedef struct soccer_tuning_t soccer_tuning_t;

/* The defaults of the list. */
extern const soccer_tuning_t soccer_tuning_default;

#endif
