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
/* K-Team's protocol, command by command, right and wrong. */
#include <string.h>
#include <unity.h>

#include "imagined_desk.h"

static desk_t desk;

void setUp(void)
{
    desk_begin(&desk);
}

void tearDown(void) {}

static void check(const char *line, const char *answer)
{
    TEST_ASSERT_EQUAL_STRING_MESSAGE(answer, desk_ask(&desk, line), line);
}

static void check_refused(const char *line)
{
    TEST_ASSERT_EQUAL_STRING_MESSAGE("z,Protocol error\r\n", desk_ask(&desk, line), line);
}

static void every_end_of_line_is_an_end_and_empty_lines_are_silent(void)
{
    check("B\n", "b,5.02,5.01\r\n");
    check("B\r", "b,5.02,5.01\r\n");
    check("B\r\n", "b,5.02,5.01\r\n");
    check("\r\n\n\r\r\n", "");
    check("B\nE\r\nH\r", "b,5.02,5.01\r\ne,0,0\r\nh,0,0\r\n");
}

static void a_half_sent_line_waits_for_its_end(void)
{
    check("D,1", "");
    desk_ticks(&desk, 100);
    check("0,10\n", "d\r\n");
}

static void gains_and_profile_are_set(void)
{
    check("A,1,2,3\n", "a\r\n");
    check("F,4,5,6\n", "f\r\n");
    check("J,7,8,9,10\n", "j\r\n");
    TEST_ASSERT_EQUAL_INT32(2, desk.robot.parameters.motion.wheel.speed.i);
    TEST_ASSERT_EQUAL_INT32(6, desk.robot.parameters.motion.wheel.position.d);
    TEST_ASSERT_EQUAL_INT32(7, desk.robot.parameters.motion.profile_speed[0]);
    TEST_ASSERT_EQUAL_INT32(10, desk.robot.parameters.motion.profile_acceleration[1]);
}

static void speed_is_driven_and_read_back(void)
{
    check("D,30,-20\n", "d\r\n");
    desk_ticks(&desk, 60);
    TEST_ASSERT_INT_WITHIN(1, 30, desk.robot.motion.wheel[0].measured_q8 / 256);
    check("D, 0 , +0\n", "d\r\n");
    desk_ticks(&desk, 60);
    check("E\n", "e,0,0\r\n");
    check("K\n", "k,1,1,0,1,1,0\r\n");
}

static void a_position_is_reached_and_told(void)
{
    check("G,100,-100\n", "g\r\n");
    check("C,300,-300\n", "c\r\n");
    check("K\n", "k,0,0,200,0,0,-200\r\n");
    desk_ticks(&desk, 200);
    TEST_ASSERT_INT_WITHIN(2, 300, desk.robot.motion.position[0]);
    TEST_ASSERT_EQUAL_STRING_LEN("k,1,0,", desk_ask(&desk, "K\n"), 6);
}

static void counters_take_any_32_bits(void)
{
    check("G,2147483647,-2147483648\n", "g\r\n");
    check("H\n", "h,2147483647,-2147483648\r\n");
    check_refused("G,2147483648,0\n");
    check_refused("C,0,0\n"); /* further than 2^23 - 2 */
}

static void pwm_and_leds(void)
{
    check("P,255,-255\n", "p\r\n");
    desk_ticks(&desk, 1);
    TEST_ASSERT_EQUAL_INT16(255, desk.duty[0]);
    TEST_ASSERT_EQUAL_INT16(-255, desk.duty[1]);
    check("L,0,1\n", "l\r\n");
    TEST_ASSERT_EQUAL_UINT8(1, desk.leds);
    check("L,1,2\n", "l\r\n");
    TEST_ASSERT_EQUAL_UINT8(3, desk.leds);
    check("L,0,0\n", "l\r\n");
    TEST_ASSERT_EQUAL_UINT8(2, desk.leds);
}

static void sensors_are_read(void)
{
    unsigned i;

    for (i = 0; i < 8; i++) {
        desk.sensors.input[i] = (uint16_t)(10 + i);
        desk.sensors.ambient[i] = (uint16_t)(1023 - i);
    }
    desk_ticks(&desk, 2);
    check("N\n", "n,10,11,12,13,14,15,16,17\r\n");
    check("O\n", "o,1023,1022,1021,1020,1019,1018,1017,1016\r\n");
    check("I,8\n", "i,491\r\n");
    desk.sensors.silent = 1;
    desk_ticks(&desk, 2);
    check("N\n", "z,A/D converter does not answer\r\n");
    check("I,0\n", "z,A/D converter does not answer\r\n");
}

static void the_extension_bus_has_data_before_address(void)
{
    check("W,170,5\n", "w\r\n");
    TEST_ASSERT_EQUAL_HEX8(170, desk.extension[5]);
    check("R,5\n", "r,170\r\n");
}

static void the_vision_turret_answers(void)
{
    report_t report;

    memset(&report, 0, sizeof report);
    report.function = FPGA_FUNCTION_SOCCER;
    report.sequence = 7;
    report.flags = 1;
    report.ball_x_q4 = 2336;
    check("T,26,N\n", "z,Turret does not answer\r\n");
    desk_ticks(&desk, 1);
    desk_show(&desk, &report);
    check("T,26,S\n", "t,26,s,0,1,0,0\r\n");
    check("T,26,N\n", "t,26,n,7,1,0,2336,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0\r\n");
    check("T,2,B\n", "z,Turret 2 is not there\r\n");
}

static void the_fpgas_registers_are_read_and_written(void)
{
    desk.registers[FPGA_REG_FUNCTION] = FPGA_FUNCTION_CAPTURE;
    check("T,26,B\n", "t,26,b,1,2\r\n"); /* without any report */
    check("T,26,W,61,4\n", "t,26,w\r\n");
    TEST_ASSERT_EQUAL_UINT16(61, desk.registers[4]);
    check("T,26,R,4\n", "t,26,r,61\r\n");
    check("T,26,W,256,4\n", "z,Register 4 does not take 256 and is 61\r\n");
    /* One that is answered later holds up what follows, and loses nothing of it. */
    check("T,26,R,4\nH\nT,26,W,0,4\nT,26,R,4\n", "t,26,r,61\r\nh,0,0\r\nt,26,w\r\nt,26,r,0\r\n");
    desk.turret_gone = 1;
    check("T,26,R,4\n", "z,Turret does not answer\r\n");
    check("T,26,W,61,4\n", "z,Turret does not answer\r\n");
    check("T,26,B\n", "z,Turret does not answer\r\n");
}

static void wrong_lines_are_refused_and_change_nothing(void)
{
    static const char *const wrong[] = {"A\n",
                                        "A,1,2\n",
                                        "A,1,2,3,4\n",
                                        "A,-1,0,0\n",
                                        "A,40000,0,0\n",
                                        "B,1\n",
                                        "C\n",
                                        "C,1\n",
                                        "C,1,2,3\n",
                                        "C,x,2\n",
                                        "D,1\n",
                                        "D,1,2,\n",
                                        "D,128,0\n",
                                        "D,0,-128\n",
                                        "D,1.5,2\n",
                                        "D,,\n",
                                        "D,1;2\n",
                                        "D1,2\n",
                                        "D 1,2\n",
                                        "E,1\n",
                                        "F,1\n",
                                        "G,1\n",
                                        "H,\n",
                                        "I\n",
                                        "I,11\n",
                                        "I,-1\n",
                                        "J,20,64\n",
                                        "J,0,64,20,64\n",
                                        "J,20,0,20,64\n",
                                        "J,128,1,1,1\n",
                                        "J,1,256,1,1\n",
                                        "K,0\n",
                                        "L,2,0\n",
                                        "L,0,3\n",
                                        "L,0\n",
                                        "N,1\n",
                                        "O,1\n",
                                        "P,256,0\n",
                                        "P,0\n",
                                        "R,64\n",
                                        "R,-1\n",
                                        "W,256,0\n",
                                        "W,0,64\n",
                                        "W,1\n",
                                        "T\n",
                                        "T,26\n",
                                        "T,26,\n",
                                        "T,32,B\n",
                                        "T,26,X\n",
                                        "T,26,B,1\n",
                                        "T,26,W,1\n",
                                        "T,26,W,1,128\n",
                                        "T,26,W,65536,4\n",
                                        "T,26,W,-1,4\n",
                                        "T,26,W,1,2,3\n",
                                        "T,26,R\n",
                                        "T,26,R,128\n",
                                        "T,26,R,-1\n",
                                        "T,26,R,4,5\n",
                                        "T,26,r,4\n",
                                        "D,99999999999,0\n",
                                        "D,\xFF,\x01\n"};
    unsigned i;

    for (i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        check_refused(wrong[i]);
    desk_ticks(&desk, 5);
    TEST_ASSERT_EQUAL(WHEEL_OFF, desk.robot.motion.wheel[0].mode);
    TEST_ASSERT_EQUAL_INT32(3800, desk.robot.parameters.motion.wheel.speed.p);
}

static void unknown_letters_are_told(void)
{
    static const char *const unknown[] = {"M\n", "Q\n", "S,1\n", "U\n", "V\n",   "X\n",
                                          "Y\n", "Z\n", "1\n",   "?\n", "\x80\n"};
    unsigned i;

    for (i = 0; i < sizeof unknown / sizeof unknown[0]; i++)
        TEST_ASSERT_EQUAL_STRING_MESSAGE("z,Command not found\r\n", desk_ask(&desk, unknown[i]),
                                         unknown[i]);
}

static void too_long_a_line_is_one_error_and_the_next_is_obeyed(void)
{
    static char line[400];

    memset(line, '1', sizeof line - 2);
    memcpy(line, "D,", 2);
    line[sizeof line - 2] = '\n';
    check_refused(line);
    check("B\n", "b,5.02,5.01\r\n");
}

static void a_line_with_a_damaged_character_is_not_obeyed(void)
{
    static const char line[] = "D,10,-12\n";
    char damaged[sizeof line];
    unsigned i;

    for (i = 0; i + 2 < sizeof line; i++) {
        memcpy(damaged, line, sizeof line);
        damaged[i] = 0x1A; /* as the serial driver marks it */
        check_refused(damaged);
        TEST_ASSERT_EQUAL(WHEEL_OFF, desk.robot.motion.wheel[0].mode);
    }
    check_refused("G,1,1\x1AG,2,2\n"); /* the end of a line was lost */
    check("\x1A\r\n", "");
    check("H\n", "h,0,0\r\n");
    check("set log.x\x1A 1\n",
          "error: a character of that line was lost on the way; send it again\r\n");
}

static void a_motion_command_ends_play(void)
{
    (void)desk_ask(&desk, "start 0\n");
    TEST_ASSERT_EQUAL_UINT8(1, desk.robot.playing);
    check("D,0,0\n", "d\r\n");
    TEST_ASSERT_EQUAL_UINT8(0, desk.robot.playing);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(every_end_of_line_is_an_end_and_empty_lines_are_silent);
    RUN_TEST(a_half_sent_line_waits_for_its_end);
    RUN_TEST(gains_and_profile_are_set);
    RUN_TEST(speed_is_driven_and_read_back);
    RUN_TEST(a_position_is_reached_and_told);
    RUN_TEST(counters_take_any_32_bits);
    RUN_TEST(pwm_and_leds);
    RUN_TEST(sensors_are_read);
    RUN_TEST(the_extension_bus_has_data_before_address);
    RUN_TEST(the_vision_turret_answers);
    RUN_TEST(the_fpgas_registers_are_read_and_written);
    RUN_TEST(wrong_lines_are_refused_and_change_nothing);
    RUN_TEST(unknown_letters_are_told);
    RUN_TEST(too_long_a_line_is_one_error_and_the_next_is_obeyed);
    RUN_TEST(a_line_with_a_damaged_character_is_not_obeyed);
    RUN_TEST(a_motion_command_ends_play);
    return UNITY_END();
}
