// sources: host-tests/khepera-firmware/imagined_pitch.c
// sources: khepera-firmware/app/robot.c khepera-firmware/app/line_editor.c
// sources: khepera-firmware/app/motion.c khepera-firmware/app/wheel.c khepera-firmware/app/pose.c
// sources: khepera-firmware/app/format.c khepera-firmware/app/log.c khepera-firmware/app/tasks.c
// sources: khepera-firmware/app/kteam.c khepera-firmware/app/shell.c
// sources: khepera-firmware/app/shell_robot.c khepera-firmware/app/shell_debug.c
// sources: khepera-firmware/app/shell_parameters.c khepera-firmware/app/shell_fpga.c
// sources: khepera-firmware/app/telemetry.c
// sources: khepera-firmware/app/parameters.c khepera-firmware/app/parameter_store.c
// sources: khepera-firmware/soccer/angle.c khepera-firmware/soccer/odometry.c
// sources: khepera-firmware/soccer/sighting.c khepera-firmware/soccer/soccer.c
// sources: khepera-firmware/soccer/strategy.c khepera-firmware/soccer/world.c
// sources: khepera-firmware/soccer/own_place.c
// sources: khepera-firmware/soccer/tuning.c khepera-firmware/soccer/freshness.c
// includes: khepera-firmware host-tests/khepera-firmware
/* Whole kick-offs in a closed loop: does it score, and only with its eyes? */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unity.h>

#include "imagined_pitch.h"

#define PI            3.14159265358979
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

/* ---- Belief against truth, while the ball is in view ---- */

#define SAMPLES_MAX 20000u
/* Nearer, the ball is clipped, and a millimetre is half a degree. */
#define NEAR_MM     150

typedef struct {
    double value[SAMPLES_MAX];
    unsigned count;
} samples_t;

static samples_t range_percent;
static samples_t bearing_deg;
static samples_t place_mm;

static void add(samples_t *samples, double value)
{
    if (samples->count < SAMPLES_MAX)
        samples->value[samples->count++] = value;
}

static int ascending(const void *a, const void *b)
{
    double left = *(const double *)a;
    double right = *(const double *)b;

    return left < right ? -1 : left > right;
}

static double percentile(samples_t *samples, unsigned percent)
{
    qsort(samples->value, samples->count, sizeof samples->value[0], ascending);
    return samples->value[(samples->count - 1) * percent / 100];
}

/* A tick's belief is of the moment at which the tick read the wheels. At the next tick. */
static void sample_belief(void)
{
    const world_t *world = &pitch.robot.soccer.world;
    double x = pitch.x;
    double y = pitch.y;
    double dx = pitch.ball_x - x;
    double dy = pitch.ball_y - y;
    double bearing = atan2(dy, dx) - pitch.heading;
    double bx;
    double by;
    pose_t pose;

    pitch_run(&pitch, 0.001);
    odometry_pose(&world->odometry, &pose);
    if (hypot(dx, dy) < NEAR_MM || !world->own.localised || !world->ball.known ||
        world->ball.age_ticks > 3)
        return;
    bx = (world->ball.x_q4 - pose.x_q4) / 16.0;
    by = (world->ball.y_q4 - pose.y_q4) / 16.0;
    bearing -= atan2(by, bx) - pose.heading * PI / 32768;
    add(&range_percent, 100 * fabs(hypot(bx, by) / hypot(dx, dy) - 1));
    add(&bearing_deg, fabs(remainder(bearing, 2 * PI)) * 180 / PI);
    add(&place_mm, hypot(pose.x_q4 / 16.0 - x, pose.y_q4 / 16.0 - y));
}

static void what_it_believes_is_nearly_true(void)
{
    char message[200];
    uint32_t seed;
    double time_s;

    range_percent.count = 0;
    bearing_deg.count = 0;
    place_mm.count = 0;
    for (seed = 1; seed <= SEEDS; seed++) {
        pitch_begin(&pitch, seed, EYES_OPEN, 1);
        (void)pitch_play(&pitch, 0.101);
        for (time_s = 0; time_s < PLAY_S && pitch.goals_for == 0; time_s += 0.05) {
            pitch_run(&pitch, 0.049);
            sample_belief();
        }
    }
    TEST_ASSERT_TRUE(range_percent.count > 1000);
    snprintf(message, sizeof message,
             "ball's range median %.1f %%, 90th %.1f %%; bearing %.2f, %.2f degrees; own place "
             "%.0f, %.0f mm",
             percentile(&range_percent, 50), percentile(&range_percent, 90),
             percentile(&bearing_deg, 50), percentile(&bearing_deg, 90), percentile(&place_mm, 50),
             percentile(&place_mm, 90));
    puts(message);
    TEST_ASSERT_TRUE_MESSAGE(percentile(&range_percent, 50) < 3, message);
    TEST_ASSERT_TRUE_MESSAGE(percentile(&range_percent, 90) < 6, message);
    TEST_ASSERT_TRUE_MESSAGE(percentile(&bearing_deg, 50) < 1, message);
    TEST_ASSERT_TRUE_MESSAGE(percentile(&bearing_deg, 90) < 2, message);
    TEST_ASSERT_TRUE_MESSAGE(percentile(&place_mm, 50) < 30, message);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(it_scores_with_exact_eyes);
    RUN_TEST(it_scores_with_noisy_eyes);
    RUN_TEST(it_never_scores_with_black_eyes);
    RUN_TEST(it_never_scores_if_it_cannot_see_the_ball);
    RUN_TEST(it_never_scores_without_reports);
    RUN_TEST(what_it_believes_is_nearly_true);
    return UNITY_END();
}
