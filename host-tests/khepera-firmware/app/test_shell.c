// sources: host-tests/khepera-firmware/imagined_desk.c
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
/* The shell: what each command answers, and the emergency stop. */
#include <string.h>
#include <unity.h>

#include "imagined_desk.h"

static desk_t desk;

void setUp(void)
{
    desk_begin(&desk);
}

void tearDown(void) {}

static void check_has(const char *line, const char *part)
{
    const char *answer = desk_ask(&desk, line);

    if (strstr(answer, part) == NULL) {
        TEST_ASSERT_EQUAL_STRING_MESSAGE(part, answer, line);
    }
}

static void check(const char *line, const char *answer)
{
    TEST_ASSERT_EQUAL_STRING_MESSAGE(answer, desk_ask(&desk, line), line);
}

static void help_names_every_command_and_parameter(void)
{
    static const char *const names[] = {
        "help", "status", "version",  "start", "stop", "estop",  "pose",   "get",  "set",
        "save", "diff",   "defaults", "tasks", "log",  "stream", "crash",  "baud", "shell",
        "raw",  "k ",     "list",     "run",   "net",  "k-team", "restart"};
    unsigned i;

    for (i = 0; i < sizeof names / sizeof names[0]; i++)
        check_has("help\n", names[i]);
    check_has("help start\n", "-180..180 deg");
    check_has("help speed.kp\n", "(0..32767, default 3800)");
    check_has("help nothing\n", "error: no command or parameter 'nothing'");
}

static void fpga_registers_are_listed_and_set_within_their_ranges(void)
{
    desk.registers[FPGA_REG_GOAL_ROW] = 60;
    check("fpga get goal_row\n",
          "goal_row = 60 row (4..235, reset 60) epipolar line of the goal\r\n");
    check_has("fpga\n", "identity and version of this list\r\nfunction = 0 (read only) ");
    check_has("fpga get goal-\n", "goal_row = 60 row (4..235");
    check_has("fpga get goal-\n", "goal_black = 0");
    check("fpga set goal-row 61\n", "ok: goal_row = 61 row\r\n");
    TEST_ASSERT_EQUAL_UINT16(61, desk.registers[FPGA_REG_GOAL_ROW]);
    check("fpga set goal_row 236\n", "error: goal_row takes one whole number; give 4..235 row\r\n");
    check("fpga set goal_row\n", "error: goal_row takes one whole number; give 4..235 row\r\n");
    check("fpga set goal_row 61 2\n",
          "error: goal_row takes one whole number; give 4..235 row\r\n");
    check_has("fpga set stream 1\n", "error: stream can only be read");
    check_has("fpga set torn 1\n", "error: torn can only be read");
    check_has("fpga get nothing\n", "error: no register 'nothing'");
    check_has("fpga set goal 1\n", "error: no register 'goal 1'");
    check_has("fpga nothing\n", "error: fpga does not know 'nothing'");
    TEST_ASSERT_EQUAL_UINT16(61, desk.registers[FPGA_REG_GOAL_ROW]);
    check_has("help goal_row\n", "fpga goal_row, row (4..235, reset 60)");
    check_has("words fpga\n", "words: get set id function stream frames\r\n");
    desk.turret_gone = 1;
    check("fpga\n", "error: the turret does not answer; is its FPGA configured?\r\n");
    check("fpga set goal_row 60\nH\n",
          "error: the turret does not answer; is its FPGA configured?\r\nh,0,0\r\n");
}

static void words_tells_what_may_follow(void)
{
    check_has("words\n", "words: help words status version start stop\r\nwords: estop ");
    check_has("words\n", " loader\r\nok: words\r\n");
    check_has("words get\n", " speed.kp ");
    check_has("words stream left.speed_mm_s\n", "left.speed_mm_s");
    check_has("words log\n", " debug\r\nok: words\r\n");
    check("words stop\n", "ok: words\r\n");
    check("words nonsense\n", "ok: words\r\n");
}

static void parameters_are_listed_set_and_put_back(void)
{
    check_has("get\n", "soccer.push_mm_s = ");
    check_has("get speed\n", "speed.ramp_mm_s2 = 5000 mm/s2 (100..20000, default 5000)");
    check("diff\n", "ok: all parameters are at their defaults\r\n");
    check("set motor.friction 9\n", "ok: motor.friction = 9 duty\r\n");
    check_has("diff\n", "motor.friction = 9 duty");
    check("set motor.friction 61\n",
          "error: 61 is out of range; give 0..60 duty (duty that friction eats)\r\n");
    check_has("set motor.friction\n", "needs one whole number; give 0..60 duty");
    check_has("set motor.friction 1 2\n", "needs one whole number");
    check_has("set nothing 1\n", "error: no parameter 'nothing'; get lists them");
    check_has("get nothing\n", "error: no parameter 'nothing'");
    check("defaults motor.friction\n", "ok: motor.friction = 6 duty\r\n");
    check("set serial.baud 19200\n", "ok: serial.baud = 19200 baud\r\n");
    check("defaults\n", "ok: all parameters at their defaults; save keeps them\r\n");
    check("save\n", "error: this base has no flash for parameters; nothing was saved\r\n");
}

static void estop_holds_whatever_comes_until_clear(void)
{
    static const char *const anywhere[] = {"estop\n", "D,10,1estop\n", "set x estop 5\r",
                                           "\x01\xFF"
                                           "estop"};
    unsigned i;

    for (i = 0; i < sizeof anywhere / sizeof anywhere[0]; i++) {
        setUp();
        (void)desk_ask(&desk, "D,50,50\n");
        desk_ticks(&desk, 20);
        TEST_ASSERT_TRUE(desk.duty[0] > 0);
        (void)desk_ask(&desk, anywhere[i]);
        TEST_ASSERT_TRUE_MESSAGE(desk.duty[0] == 0 && desk.duty[1] == 0, anywhere[i]);
        (void)desk_ask(&desk, "\n");
        check("D,50,50\n", "z,Emergency stop: estop clear releases it\r\n");
        check("P,50,50\n", "z,Emergency stop: estop clear releases it\r\n");
        check("C,50,50\n", "z,Emergency stop: estop clear releases it\r\n");
        check("start 0\n", "error: emergency stop; estop clear releases it\r\n");
        desk_ticks(&desk, 5);
        TEST_ASSERT_TRUE(desk.duty[0] == 0 && desk.duty[1] == 0);
        check_has("status\n", "state: emergency stop");
        check("estop clear\n", "ok: released\r\n");
        check("D,50,50\n", "d\r\n");
    }
}

static void streams_come_at_their_rate(void)
{
    check("stream left.speed_mm_s,battery_mv 20\n",
          "ok: stream time_ms,left.speed_mm_s,battery_mv every 50 ms\r\n");
    desk.printed_count = 0;
    desk_ticks(&desk, 11);
    TEST_ASSERT_EQUAL_STRING("~50,0,4799\r\n~100,0,4799\r\n", desk.printed);
    check("stream off\n", "ok: stream off, 0 lines did not fit the line\r\n");
    check_has("stream\n", "pose.heading_deg10");
    check_has("stream nothing 5\n", "error: cannot make sense of 'nothing 5'");
    check_has("stream left.duty 0\n", "1..100 Hz");
    check_has("stream left.duty 101\n", "1..100 Hz");
    check_has("stream left.duty\n", "error: ");
    check_has("stream 5\n", "error: ");
}

static void a_stream_without_room_is_dropped_and_counted(void)
{
    (void)desk_ask(&desk, "stream left.duty 100\n");
    desk.room = 0;
    desk.printed_count = 0;
    desk_ticks(&desk, 7);
    TEST_ASSERT_EQUAL_UINT32(0, desk.printed_count);
    desk.room = UINT32_MAX;
    check("stream off\n", "ok: stream off, 7 lines did not fit the line\r\n");
}

static void lines_wait_for_room_and_are_not_lost(void)
{
    desk.room = 0;
    desk_feed(&desk, "B\nH\n", 4);
    TEST_ASSERT_EQUAL_UINT32(4, desk.input_left);
    desk.room = UINT32_MAX;
    desk.printed_count = 0;
    desk_ticks(&desk, 5);
    TEST_ASSERT_EQUAL_STRING("b,5.02,5.01\r\nh,0,0\r\n", desk.printed);
}

static void log_keeps_what_its_levels_let_through(void)
{
    check_has("log\n", "motion   info");
    check_has("log show\n", "system info] reset by power");
    check("log motion off\n", "ok: log motion off\r\n");
    check_has("log motion loud\n", "error: 'motion loud' is not a module and a level");
    check("log live on\n", "ok: log live on\r\n");
    desk.sensors.silent = 1;
    desk.printed_count = 0;
    desk_ticks(&desk, 2);
    TEST_ASSERT_NOT_NULL(
        strstr(desk.printed, "[0.020 sensors warn] A/D converter does not answer"));
    check_has("status\n", "fault: A/D converter does not answer");
}

static void crash_show_tells_and_clear_forgets(void)
{
    static crash_record_t record;

    check("crash show\n", "ok: no crash since power-on or clear\r\n");
    record.frame[1] = 0x0010;
    record.frame[2] = 0x2468;
    record.frame[3] = 0xC00C;
    record.registers[9] = 0xDEADBEEF;
    desk.crash = &record;
    check_has("crash show\n", "cause: vector 3, address error\r\npc: 00102468");
    check_has("crash show\n", "a1 DEADBEEF");
    check_has("status\n", "crash: there was one");
    check("crash clear\n", "ok: forgotten\r\n");
    check("crash show\n", "ok: no crash since power-on or clear\r\n");
    check_has("crash\n", "error: crash needs to know");
}

static void the_line_itself_can_be_set(void)
{
    check("baud 38400\n", "ok: 38400 baud from now on; set serial.baud and save keep it\r\n");
    TEST_ASSERT_EQUAL_UINT32(38400, desk.baud);
    check_has("baud 1234\n", "error: baud needs a rate");
    check("shell\n", "ok: echo on; raw turns it off\r\n> ");
    check("stop\n", "stop\r\nok: stopped\r\n> ");
    check("D,0,0\n", "d\r\n");
    check("stop\n", "ok: stopped\r\n");
    check("k H\n", "h,0,0\r\n");
    check_has("k h\n", "error: that is no line of K-Team's protocol");
}

static void k_teams_words_answer(void)
{
    check("list\n", "soccer\r\n");
    check("run soccer 90\n", "ok: playing, heading 90\r\n");
    check_has("run demo\n", "error: no such program");
    check_has("net\n", "26 vision");
    check_has("k-team\n", "K-Team");
    check("restart\n", "ok: restart\r\n");
    TEST_ASSERT_EQUAL(1 + BASE_RESTART, desk.restarted);
    setUp();
    check("loader\n", "ok: loader\r\n");
    TEST_ASSERT_EQUAL(1 + BASE_LOADER, desk.restarted);
}

static void a_blocked_wheel_is_told(void)
{
    unsigned i;

    (void)desk_ask(&desk, "D,50,50\n");
    for (i = 0; i < 30; i++) {
        desk_ticks(&desk, 1);
        desk.travel[0] = desk.speed[0] = 0;
    }
    TEST_ASSERT_TRUE(desk.duty[0] == 0 && desk.duty[1] == 0);
    check_has("status\n", "fault: left wheel does not turn");
    check_has("log show\n", "motion warn] left wheel does not turn");
}

static void a_command_that_takes_nothing_says_so(void)
{
    check("status now\n", "error: nothing may follow this command; leave 'now' out\r\n");
    check("dance\n", "error: no such command; help lists them\r\n");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(help_names_every_command_and_parameter);
    RUN_TEST(fpga_registers_are_listed_and_set_within_their_ranges);
    RUN_TEST(words_tells_what_may_follow);
    RUN_TEST(parameters_are_listed_set_and_put_back);
    RUN_TEST(estop_holds_whatever_comes_until_clear);
    RUN_TEST(streams_come_at_their_rate);
    RUN_TEST(a_stream_without_room_is_dropped_and_counted);
    RUN_TEST(lines_wait_for_room_and_are_not_lost);
    RUN_TEST(log_keeps_what_its_levels_let_through);
    RUN_TEST(crash_show_tells_and_clear_forgets);
    RUN_TEST(the_line_itself_can_be_set);
    RUN_TEST(k_teams_words_answer);
    RUN_TEST(a_blocked_wheel_is_told);
    RUN_TEST(a_command_that_takes_nothing_says_so);
    return UNITY_END();
}
