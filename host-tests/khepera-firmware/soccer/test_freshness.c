// sources: khepera-firmware/soccer/freshness.c
// includes: khepera-firmware
/* Which reports are news. A turret of its own clock sends one each 25 ms; it takes them 24 ms. */
#include "soccer/freshness.h"

#include <string.h>
#include <unity.h>

#define LATENCY_100US 240u

static freshness_t fresh;
static uint32_t now_ms;
static uint32_t ticks;
static uint16_t turret_ahead; /* the turret's clock minus the base's */
static uint8_t sequence;

void setUp(void)
{
    freshness_init(&fresh);
    now_ms = 0;
    ticks = 0;
    turret_ahead = 12345;
    sequence = 250;
}

void tearDown(void) {}

static void pass(uint32_t ms)
{
    now_ms += ms;
    for (; ticks < now_ms / 10; ticks++)
        freshness_tick(&fresh);
}

/* A report exposed `age_ms` ago beyond what is usual, arriving now. */
static report_t exposed(uint32_t age_ms, uint8_t number)
{
    report_t report;

    memset(&report, 0, sizeof report);
    report.sequence = number;
    report.exposure_time = (uint16_t)(now_ms * 10 - age_ms * 10 - LATENCY_100US + turret_ahead);
    return report;
}

static int take(uint32_t age_ms, uint8_t number)
{
    report_t report = exposed(age_ms, number);

    return freshness_take(&fresh, &report, 0);
}

static void run(unsigned reports)
{
    for (; reports > 0; reports--) {
        pass(25);
        TEST_ASSERT_TRUE(take(0, ++sequence));
    }
}

static void a_steady_stream_is_news_while_all_clocks_wrap(void)
{
    run(1000);
}

static void with_jitter_too(void)
{
    unsigned i;

    run(10);
    for (i = 0; i < 300; i++) {
        pass(25);
        TEST_ASSERT_TRUE(take(i * 7 % 60, ++sequence));
    }
}

static void a_repeated_one_is_not_however_long_it_goes_on(void)
{
    report_t same;
    unsigned i;

    run(10);
    same = exposed(0, sequence);
    for (i = 0; i < 400; i++) {
        pass(25);
        if (i % 2 == 0)
            same.exposure_time = (uint16_t)(same.exposure_time + 500);
        TEST_ASSERT_FALSE(freshness_take(&fresh, &same, 0));
    }
}

static void an_older_one_after_a_newer_one_is_not(void)
{
    run(10);
    pass(5);
    TEST_ASSERT_FALSE(take(30, (uint8_t)(sequence - 1)));
    pass(20);
    TEST_ASSERT_TRUE(take(0, ++sequence));
}

static void one_held_up_is_not(void)
{
    uint32_t late_ms;

    run(10);
    for (late_ms = 120; late_ms < 1990; late_ms += 50) {
        pass(25);
        TEST_ASSERT_FALSE_MESSAGE(take(late_ms, ++sequence), "late by 120..1990 ms");
        run(2);
    }
}

static void held_up_ones_do_not_become_news_by_coming_alone(void)
{
    unsigned i;

    run(10);
    for (i = 0; i < 110; i++) {
        pass(25);
        TEST_ASSERT_FALSE(take(300, ++sequence));
    }
    pass(25);
    TEST_ASSERT_TRUE(take(0, ++sequence));
}

static void a_turret_that_starts_anew_is_believed_again(void)
{
    uint32_t jump;
    unsigned i;

    for (jump = 0; jump < 65536; jump += 4001) {
        run(10);
        turret_ahead = (uint16_t)(turret_ahead + jump);
        sequence = (uint8_t)(sequence + 100 + jump);
        /* At the latest after FRESHNESS_RESYNC_TICKS. */
        for (i = 0; i < 122; i++) {
            pass(25);
            if (take(0, ++sequence))
                break;
        }
        TEST_ASSERT_TRUE_MESSAGE(i < 122, "never believed again");
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_steady_stream_is_news_while_all_clocks_wrap);
    RUN_TEST(with_jitter_too);
    RUN_TEST(a_repeated_one_is_not_however_long_it_goes_on);
    RUN_TEST(an_older_one_after_a_newer_one_is_not);
    RUN_TEST(one_held_up_is_not);
    RUN_TEST(held_up_ones_do_not_become_news_by_coming_alone);
    RUN_TEST(a_turret_that_starts_anew_is_believed_again);
    return UNITY_END();
}
