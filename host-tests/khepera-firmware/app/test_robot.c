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
/* The robot's program on an imagined base: console, kick-off, stop, and loss of the eyes. */
#include <math.h>
#include <string.h>
#include <unity.h>

#include "imagined_pitch.h"

static pitch_t pitch;

void setUp(void)
{
    pitch_begin(&pitch, 1, EYES_OPEN, 0);
}

void tearDown(void) {}

static const char *answer(const char *line)
{
    pitch.printed_count = 0;
    pitch.printed[0] = '\0';
    pitch_type(&pitch, line);
    pitch_run(&pitch, 0.05);
    return pitch.printed;
}

static int motors_off(void)
{
    return pitch.duty[0] == 0 && pitch.duty[1] == 0;
}

static void it_stands_still_until_told_to_start(void)
{
    double x = pitch.x;
    double heading = pitch.heading;

    pitch_run(&pitch, 3);
    TEST_ASSERT_TRUE(motors_off());
    TEST_ASSERT_TRUE(pitch.x == x && pitch.heading == heading);
}

static void help_names_every_command(void)
{
    const char *help = answer("help\n");

    TEST_ASSERT_NOT_NULL(strstr(help, "status"));
    TEST_ASSERT_NOT_NULL(strstr(help, "start HEADING"));
    TEST_ASSERT_NOT_NULL(strstr(help, "stop"));
}

static void start_answers_and_drives(void)
{
    TEST_ASSERT_EQUAL_STRING("ok: playing, heading -90\r\n", answer("start -90\r\n"));
    pitch_run(&pitch, 0.5);
    TEST_ASSERT_FALSE(motors_off());
    TEST_ASSERT_EQUAL_UINT8(1, pitch.leds & 1);
}

static void a_wrong_start_is_refused_with_the_cure(void)
{
    static const char *const wrong[] = {"start\n", "start north\n", "start 181\n", "start -181\n",
                                        "start 1 2\n"};
    unsigned i;

    for (i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        const char *reply = answer(wrong[i]);

        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(reply, "error: "), wrong[i]);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(reply, "-180..180"), wrong[i]);
    }
    pitch_run(&pitch, 0.5);
    TEST_ASSERT_TRUE(motors_off());
}

static void an_unknown_command_points_to_help(void)
{
    TEST_ASSERT_EQUAL_STRING("error: no such command; help lists them\r\n", answer("dance\n"));
}

static void stop_turns_the_motors_off_at_once(void)
{
    (void)answer("start 0\n");
    pitch_run(&pitch, 1);
    TEST_ASSERT_FALSE(motors_off());
    TEST_ASSERT_EQUAL_STRING("ok: stopped\r\n", answer("stop\n"));
    TEST_ASSERT_TRUE(motors_off());
    pitch_run(&pitch, 1);
    TEST_ASSERT_TRUE(motors_off());
}

static void status_says_what_it_believes(void)
{
    const char *status;

    pitch_play(&pitch, 2);
    status = answer("status\n");
    TEST_ASSERT_NOT_NULL(strstr(status, "turret: soccer"));
    TEST_ASSERT_NOT_NULL(strstr(status, "pose: x "));
    TEST_ASSERT_NOT_NULL(strstr(status, "since reset by power"));
}

static void without_reports_it_says_why_and_only_turns(void)
{
    double x;
    double y;

    pitch_begin(&pitch, 3, EYES_DEAD, 0);
    TEST_ASSERT_NOT_NULL(strstr(answer("status\n"), "is its FPGA configured?"));
    x = pitch.x;
    y = pitch.y;
    pitch_play(&pitch, 20);
    TEST_ASSERT_TRUE(hypot(pitch.x - x, pitch.y - y) < 20);
}

static void motors_stop_200_ms_after_the_last_report(void)
{
    pitch_play(&pitch, 1.5);
    TEST_ASSERT_FALSE(motors_off());
    pitch.eyes = EYES_DEAD;
    pitch_run(&pitch, 0.25);
    TEST_ASSERT_TRUE(motors_off());
    pitch_run(&pitch, 0.6);
    TEST_ASSERT_TRUE(motors_off());
    pitch_run(&pitch, 0.6);
    TEST_ASSERT_FALSE_MESSAGE(motors_off(), "after a second it looks around by itself");
    TEST_ASSERT_INT_WITHIN(6, 0, lround(pitch.wheel_mm_s[0] + pitch.wheel_mm_s[1]));
    pitch.eyes = EYES_OPEN;
    pitch_run(&pitch, 0.5);
    TEST_ASSERT_FALSE(motors_off());
}

static void check_that_it_stops_and_recovers(pitch_eyes_t eyes)
{
    pitch_play(&pitch, 1.5);
    TEST_ASSERT_FALSE(motors_off());
    pitch.eyes = eyes;
    pitch_run(&pitch, 0.3);
    TEST_ASSERT_TRUE(motors_off());
    pitch.eyes = EYES_OPEN;
    pitch_run(&pitch, 0.3);
    TEST_ASSERT_FALSE(motors_off());
}

static void damaged_reports_are_no_reports(void)
{
    check_that_it_stops_and_recovers(EYES_DAMAGED);
    TEST_ASSERT_TRUE(pitch.robot.bad_reports > 5);
}

static void a_report_shown_again_and_again_is_none(void)
{
    check_that_it_stops_and_recovers(EYES_FROZEN);
}

static void a_flood_of_characters_does_not_stop_control(void)
{
    static char flood[20000];
    unsigned i;

    for (i = 0; i + 1 < sizeof flood; i++)
        flood[i] = (char)(1 + i % 255);
    /* A goal would stop the imagined time. */
    pitch_begin(&pitch, 1, EYES_BLIND_TO_BALL, 0);
    pitch_play(&pitch, 1);
    pitch_type(&pitch, flood);
    pitch_run(&pitch, 5);
    TEST_ASSERT_EQUAL_STRING("", pitch.typed);
    (void)answer("\nraw\n"); /* there was a Tab in it */
    TEST_ASSERT_EQUAL_STRING("ok: stopped\r\n", answer("stop\n"));
    TEST_ASSERT_TRUE(motors_off());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(it_stands_still_until_told_to_start);
    RUN_TEST(help_names_every_command);
    RUN_TEST(start_answers_and_drives);
    RUN_TEST(a_wrong_start_is_refused_with_the_cure);
    RUN_TEST(an_unknown_command_points_to_help);
    RUN_TEST(stop_turns_the_motors_off_at_once);
    RUN_TEST(status_says_what_it_believes);
    RUN_TEST(without_reports_it_says_why_and_only_turns);
    RUN_TEST(motors_stop_200_ms_after_the_last_report);
    RUN_TEST(damaged_reports_are_no_reports);
    RUN_TEST(a_report_shown_again_and_again_is_none);
    RUN_TEST(a_flood_of_characters_does_not_stop_control);
    return UNITY_END();
}
