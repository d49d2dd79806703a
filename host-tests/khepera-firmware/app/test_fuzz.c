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
/* A million lines of rubbish, half rubbish and commands: never a crash, never a stuck motor. */
#include <stdio.h>
#include <string.h>
#include <unity.h>

#include "imagined_desk.h"

#define LINES     1000000u
#define LINE_SIZE 200u

static desk_t desk;
static uint32_t random_state;

void setUp(void)
{
    desk_begin(&desk);
    random_state = 1;
}

void tearDown(void) {}

static uint32_t draw(uint32_t below)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (random_state >> 8) % below;
}

static uint32_t add(uint8_t *line, uint32_t at, const char *text)
{
    uint32_t length = (uint32_t)strlen(text);

    if (at + length >= LINE_SIZE)
        return at;
    memcpy(&line[at], text, length);
    return at + length;
}

static uint32_t random_command(uint8_t *line)
{
    static const char *const words[] = {"help",
                                        "status",
                                        "version",
                                        "start 0",
                                        "stop",
                                        "estop",
                                        "estop clear",
                                        "pose",
                                        "get",
                                        "set",
                                        "set speed.kp 9",
                                        "defaults",
                                        "diff",
                                        "tasks",
                                        "log",
                                        "log show",
                                        "log live on",
                                        "log motion debug",
                                        "stream left.duty 50",
                                        "stream off",
                                        "crash show",
                                        "baud 38400",
                                        "shell",
                                        "raw",
                                        "k",
                                        "list",
                                        "run",
                                        "net",
                                        "k-team",
                                        "save"};
    char number[16];
    uint32_t at = 0;
    uint32_t i;

    if (draw(2) == 0)
        return add(line, 0, words[draw(sizeof words / sizeof words[0])]);
    line[at++] = (uint8_t)('A' + draw(26));
    for (i = draw(5); i > 0; i--) {
        snprintf(number, sizeof number, ",%ld", (long)draw(600) - 300);
        at = add(line, at, number);
    }
    return at;
}

static uint32_t random_line(uint8_t line[LINE_SIZE])
{
    uint32_t length = random_command(line);
    uint32_t i;

    switch (draw(4)) {
    case 0: /* rubbish */
        length = draw(LINE_SIZE - 2);
        for (i = 0; i < length; i++)
            line[i] = (uint8_t)draw(256);
        break;
    case 1: /* a command with something wrong in it */
        for (i = 0; i < 2; i++)
            line[draw(length)] = (uint8_t)draw(256);
        break;
    case 2: /* cut short */
        length = draw(length + 1);
        break;
    default:
        break;
    }
    line[length] = draw(2) ? '\n' : '\r';
    return length + 1;
}

static void a_million_lines_leave_a_robot_that_obeys(void)
{
    uint8_t line[LINE_SIZE];
    uint32_t i;

    for (i = 0; i < LINES; i++) {
        desk.printed_count = 0;
        desk_feed(&desk, line, random_line(line));
        TEST_ASSERT_LESS_THAN_UINT32(DESK_PRINTED_SIZE / 2, desk.printed_count);
        if (i % 16 == 0)
            desk_ticks(&desk, 1);
        if (i % 4096 != 0)
            continue;
        (void)desk_ask(&desk, "\nraw\n");
        TEST_ASSERT_EQUAL_STRING("b,5.02,5.01\r\n", desk_ask(&desk, "B\n"));
        (void)desk_ask(&desk, "estop\n");
        TEST_ASSERT_TRUE(desk.duty[0] == 0 && desk.duty[1] == 0);
        desk_ticks(&desk, 3);
        TEST_ASSERT_TRUE(desk.duty[0] == 0 && desk.duty[1] == 0);
        (void)desk_ask(&desk, "estop clear\n");
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_million_lines_leave_a_robot_that_obeys);
    return UNITY_END();
}
