// sources: host-tests/khepera-firmware/imagined_pitch.c
// sources: khepera-firmware/app/robot.c khepera-firmware/app/console.c
// sources: khepera-firmware/app/motion.c khepera-firmware/app/text.c
// sources: khepera-firmware/soccer/angle.c khepera-firmware/soccer/odometry.c
// sources: khepera-firmware/soccer/sighting.c khepera-firmware/soccer/soccer.c
// sources: khepera-firmware/soccer/strategy.c khepera-firmware/soccer/world.c
// includes: khepera-firmware host-tests/khepera-firmware
/* Whole kick-offs in a closed loop: does it score, and only with its eyes? */
#include <stdio.h>
#include <unity.h>

#include "imagined_pitch.h"

#define SEEDS         60u
#define PLAY_S        60.0
/* What must be reached, of SEEDS; a single seed may go either way. */
#define GOALS_MIN     57u
#define OWN_GOALS_MAX 1u

static pitch_t pitch;

void setUp(void) {}

void tearDown(void) {}

typedef struct {
    unsigned goals, own_goals;
    char missed[8 * SEEDS]; /* seeds without a goal: what replays a failure */
} score_t;

static void play_all(pitch_eyes_t eyes, double noise, score_t *score)
{
    int used = 0;
    uint32_t seed;

    score->goals = 0;
    score->own_goals = 0;
    score->missed[0] = '\0';
    for (seed = 1; seed <= SEEDS; seed++) {
        pitch_begin(&pitch, seed, eyes, noise);
        (void)pitch_play(&pitch, PLAY_S);
        score->goals += pitch.goals_for > 0;
        score->own_goals += pitch.goals_against > 0;
        if (pitch.goals_for == 0)
            used += snprintf(score->missed + used, sizeof score->missed - (size_t)used, " %u",
                             (unsigned)seed);
    }
}

static void check_that_it_scores(double noise)
{
    score_t score;
    char message[sizeof score.missed + 80];

    play_all(EYES_OPEN, noise, &score);
    snprintf(message, sizeof message, "%u goals, %u own goals; no goal with the seeds%s",
             score.goals, score.own_goals, score.missed);
    puts(message);
    TEST_ASSERT_TRUE_MESSAGE(score.goals >= GOALS_MIN, message);
    TEST_ASSERT_TRUE_MESSAGE(score.own_goals <= OWN_GOALS_MAX, message);
}

static void it_scores_with_exact_eyes(void)
{
    check_that_it_scores(0);
}

static void it_scores_with_noisy_eyes(void)
{
    check_that_it_scores(1);
}

static void check_that_it_never_scores(pitch_eyes_t eyes)
{
    score_t score;

    play_all(eyes, 1, &score);
    TEST_ASSERT_EQUAL_UINT(0, score.goals);
}

static void it_never_scores_with_black_eyes(void)
{
    check_that_it_never_scores(EYES_BLACK);
}

static void it_never_scores_if_it_cannot_see_the_ball(void)
{
    check_that_it_never_scores(EYES_BLIND_TO_BALL);
}

static void it_never_scores_without_reports(void)
{
    check_that_it_never_scores(EYES_DEAD);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(it_scores_with_exact_eyes);
    RUN_TEST(it_scores_with_noisy_eyes);
    RUN_TEST(it_never_scores_with_black_eyes);
    RUN_TEST(it_never_scores_if_it_cannot_see_the_ball);
    RUN_TEST(it_never_scores_without_reports);
    return UNITY_END();
}
