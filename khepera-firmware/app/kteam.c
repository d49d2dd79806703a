#include "app/kteam.h"

#include <stddef.h>

#include "board/khepera.h"
#include "link/registers.h"

/* What we claim to be: BIOS and protocol of a Khepera II. */
#define VERSIONS          "5.02,5.01"
#define PROTOCOL_ERROR    "z,Protocol error\r\n"
#define TURRET_SILENT     "z,Turret does not answer\r\n"
#define ARGUMENTS_MAX     4u
#define EXTENSION_BUS_MAX 63
#define TURRET_ID_MAX     31

/* Reads `count` decimals, each after a comma, and nothing after them. */
static int arguments_are(const char *text, int32_t *arguments, unsigned count)
{
    unsigned i;

    for (i = 0; i < count; i++)
        if (*text++ != ',' || !text_number(&text, &arguments[i]))
            return 0;
    return *text_skip_blanks(text) == '\0';
}

static int within(int32_t value, int32_t min, int32_t max)
{
    return value >= min && value <= max;
}

static int all_within(const int32_t *values, unsigned count, int32_t min, int32_t max)
{
    unsigned i;

    for (i = 0; i < count; i++)
        if (!within(values[i], min, max))
            return 0;
    return 1;
}

/* ---- Each command gets its arguments; 0 = they are out of range ---- */

static int set_gains(wheel_gains_t *gains, const int32_t *arguments)
{
    if (!all_within(arguments, 3, 0, INT16_MAX))
        return 0;
    gains->p = arguments[0];
    gains->i = arguments[1];
    gains->d = arguments[2];
    return 1;
}

static int command_a(robot_t *robot, const int32_t *arguments)
{
    if (!set_gains(&robot->parameters.motion.wheel.speed, arguments))
        return 0;
    robot_print(robot, "a\r\n");
    return 1;
}

static int command_b(robot_t *robot, const int32_t *arguments)
{
    (void)arguments;
    robot_print(robot, "b,%s\r\n", VERSIONS);
    return 1;
}

static int may_move(robot_t *robot)
{
    if (robot_take_over(robot))
        return 1;
    robot_print(robot, "z,Emergency stop: estop clear releases it\r\n");
    return 0;
}

static int command_c(robot_t *robot, const int32_t *arguments)
{
    if (!may_move(robot))
        return 1;
    if (!motion_position(&robot->motion, arguments[0], arguments[1]))
        return 0;
    robot_print(robot, "c\r\n");
    return 1;
}

static int command_d(robot_t *robot, const int32_t *arguments)
{
    if (!all_within(arguments, 2, -MOTION_MAX_SPEED, MOTION_MAX_SPEED))
        return 0;
    if (may_move(robot)) {
        motion_speed(&robot->motion, arguments[0], arguments[1]);
        robot_print(robot, "d\r\n");
    }
    return 1;
}

static int command_e(robot_t *robot, const int32_t *arguments)
{
    const wheel_t *wheel = robot->motion.wheel;

    (void)arguments;
    robot_print(robot, "e,%d,%d\r\n", wheel[0].measured_q8 / 256, wheel[1].measured_q8 / 256);
    return 1;
}

static int command_f(robot_t *robot, const int32_t *arguments)
{
    if (!set_gains(&robot->parameters.motion.wheel.position, arguments))
        return 0;
    robot_print(robot, "f\r\n");
    return 1;
}

static int command_g(robot_t *robot, const int32_t *arguments)
{
    motion_set_counters(&robot->motion, arguments[0], arguments[1]);
    robot_print(robot, "g\r\n");
    return 1;
}

static int command_h(robot_t *robot, const int32_t *arguments)
{
    (void)arguments;
    robot_print(robot, "h,%d,%d\r\n", robot->motion.position[0], robot->motion.position[1]);
    return 1;
}

/* Old readings would tell of a way that is no longer free. */
static int converter_answers(const robot_t *robot)
{
    if (robot->sensors.silent)
        robot_print(robot, "z,A/D converter does not answer\r\n");
    return !robot->sensors.silent;
}

static int command_i(robot_t *robot, const int32_t *arguments)
{
    if (!within(arguments[0], 0, ADC_INPUTS - 1))
        return 0;
    if (converter_answers(robot))
        robot_print(robot, "i,%d\r\n", robot->sensors.input[arguments[0]]);
    return 1;
}

static int command_j(robot_t *robot, const int32_t *arguments)
{
    motion_settings_t *settings = &robot->parameters.motion;
    unsigned i;

    for (i = 0; i < 2; i++)
        if (!within(arguments[2 * i], 1, MOTION_MAX_SPEED) ||
            !within(arguments[2 * i + 1], 1, UINT8_MAX))
            return 0;
    for (i = 0; i < 2; i++) {
        settings->profile_speed[i] = arguments[2 * i];
        settings->profile_acceleration[i] = arguments[2 * i + 1];
    }
    robot_print(robot, "j\r\n");
    return 1;
}

static int command_k(robot_t *robot, const int32_t *arguments)
{
    unsigned i;

    (void)arguments;
    robot_print(robot, "k");
    for (i = 0; i < 2; i++) {
        const wheel_t *wheel = &robot->motion.wheel[i];

        robot_print(robot, ",%d,%d,%d", wheel_on_target(wheel), wheel->mode != WHEEL_POSITION,
                    wheel_error(wheel));
    }
    robot_print(robot, "\r\n");
    return 1;
}

static int command_l(robot_t *robot, const int32_t *arguments)
{
    uint8_t led;

    if (!within(arguments[0], 0, 1) || !within(arguments[1], 0, 2))
        return 0;
    led = (uint8_t)(1u << arguments[0]);
    if (arguments[1] == 2)
        robot->leds ^= led;
    else if (arguments[1] == 1)
        robot->leds |= led;
    else
        robot->leds &= (uint8_t)~led;
    robot->base->leds(robot->base->context, robot->leds);
    robot_print(robot, "l\r\n");
    return 1;
}

static int eight_values(const robot_t *robot, char letter, const uint16_t *values)
{
    unsigned i;

    if (!converter_answers(robot))
        return 1;
    robot_print(robot, "%c", letter);
    for (i = 0; i < ADC_SENSORS; i++)
        robot_print(robot, ",%d", values[i]);
    robot_print(robot, "\r\n");
    return 1;
}

static int command_n(robot_t *robot, const int32_t *arguments)
{
    (void)arguments;
    return eight_values(robot, 'n', &robot->sensors.input[BOARD_ADC_PROXIMITY]);
}

static int command_o(robot_t *robot, const int32_t *arguments)
{
    (void)arguments;
    return eight_values(robot, 'o', robot->sensors.ambient);
}

static int command_p(robot_t *robot, const int32_t *arguments)
{
    if (!all_within(arguments, 2, -WHEEL_DUTY_MAX, WHEEL_DUTY_MAX))
        return 0;
    if (may_move(robot)) {
        motion_pwm(&robot->motion, (int16_t)arguments[0], (int16_t)arguments[1]);
        robot_print(robot, "p\r\n");
    }
    return 1;
}

static int command_r(robot_t *robot, const int32_t *arguments)
{
    const base_t *base = robot->base;

    if (!within(arguments[0], 0, EXTENSION_BUS_MAX))
        return 0;
    robot_print(robot, "r,%d\r\n", base->bus_read(base->context, (uint8_t)arguments[0]));
    return 1;
}

static int command_w(robot_t *robot, const int32_t *arguments)
{
    const base_t *base = robot->base;

    if (!within(arguments[0], 0, UINT8_MAX) || !within(arguments[1], 0, EXTENSION_BUS_MAX))
        return 0;
    base->bus_write(base->context, (uint8_t)arguments[1], (uint8_t)arguments[0]);
    robot_print(robot, "w\r\n");
    return 1;
}

/* ---- T: to a turret ---- */

static void print_report(const robot_t *robot)
{
    const report_t *report = &robot->report;

    robot_print(robot, "t,%d,n,%d,%d,%d,%d,%d,%d,%d", BOARD_TURRET_ID, report->sequence,
                report->flags, report->exposure_time, report->ball_x_q4, report->ball_row,
                report->ball_width_px, report->ball_disparity_q4);
    robot_print(robot, ",%d,%d,%d,%d,%d,%d", report->goal_x_q4[0], report->goal_x_q4[1],
                report->goal_disparity_q4[0], report->goal_disparity_q4[1], report->opponent_x_q4,
                report->opponent_disparity_q4);
    robot_print(robot, ",%d,%d,%d,%d,%d,%d\r\n", report->wall_row[0], report->wall_row[1],
                report->wall_row[2], report->ball_confidence, report->goal_confidence,
                report->opponent_confidence);
}

static void answer_version(robot_t *robot, const uint16_t *value)
{
    if (value != NULL)
        robot_print(robot, "t,%d,b,%d,%d\r\n", BOARD_TURRET_ID, REPORT_VERSION, *value);
    else
        robot_print(robot, TURRET_SILENT);
}

static void answer_read(robot_t *robot, const uint16_t *value)
{
    if (value != NULL)
        robot_print(robot, "t,%d,r,%d\r\n", BOARD_TURRET_ID, *value);
    else
        robot_print(robot, TURRET_SILENT);
}

static void answer_write(robot_t *robot, const uint16_t *value)
{
    if (value == NULL)
        robot_print(robot, TURRET_SILENT);
    else if (*value == robot->register_wanted)
        robot_print(robot, "t,%d,w\r\n", BOARD_TURRET_ID);
    else
        robot_print(robot, "z,Register %d does not take %d and is %d\r\n", robot->register_address,
                    robot->register_wanted, *value);
}

/* R,address and W,value,address; 0 = protocol error. */
static int access_register(robot_t *robot, char letter, const char *text)
{
    int32_t arguments[2] = {0, 0};
    int32_t *address = letter == 'W' ? &arguments[1] : &arguments[0];

    if (!arguments_are(text, arguments, letter == 'W' ? 2 : 1) ||
        !within(*address, 0, (int32_t)FPGA_REG_COUNT - 1))
        return 0;
    if (letter == 'R')
        robot_register_read(robot, (uint8_t)*address, answer_read);
    else if (within(arguments[0], 0, UINT16_MAX))
        robot_register_write(robot, (uint8_t)*address, (uint16_t)arguments[0], answer_write);
    else
        return 0;
    return 1;
}

/* N, S: what has come by itself. */
static void tell_reports(robot_t *robot, char letter)
{
    if (robot->silent_ticks >= ROBOT_REPORT_TIMEOUT_TICKS)
        robot_print(robot, TURRET_SILENT);
    else if (letter == 'N')
        print_report(robot);
    else
        robot_print(robot, "t,%d,s,%d,%d,%d,%d\r\n", BOARD_TURRET_ID, robot->silent_ticks * 10,
                    (int32_t)robot->reports, robot->bad_reports,
                    robot->base->reports_lost(robot->base->context));
}

/* A command of the vision turret; 0 = protocol error. */
static int obey_turret(robot_t *robot, const char *text)
{
    char letter = *text++;
    int32_t none;

    if (letter == 'R' || letter == 'W')
        return access_register(robot, letter, text);
    if (!arguments_are(text, &none, 0))
        return 0;
    if (letter == 'B')
        robot_register_read(robot, FPGA_REG_FUNCTION, answer_version);
    else if (letter == 'N' || letter == 'S')
        tell_reports(robot, letter);
    else
        return 0;
    return 1;
}

static int command_t(robot_t *robot, const char *text)
{
    int32_t id;

    if (*text++ != ',' || !text_number(&text, &id) || !within(id, 0, TURRET_ID_MAX) ||
        *text++ != ',' || *text == '\0')
        return 0;
    if (id == BOARD_TURRET_ID)
        return obey_turret(robot, text);
    robot_print(robot, "z,Turret %d is not there\r\n", id);
    return 1;
}

static const struct {
    char letter;
    uint8_t arguments;
    int (*obey)(robot_t *robot, const int32_t *arguments);
} commands[] = {
    {'A', 3, command_a}, {'B', 0, command_b}, {'C', 2, command_c}, {'D', 2, command_d},
    {'E', 0, command_e}, {'F', 3, command_f}, {'G', 2, command_g}, {'H', 0, command_h},
    {'I', 1, command_i}, {'J', 4, command_j}, {'K', 0, command_k}, {'L', 2, command_l},
    {'N', 0, command_n}, {'O', 0, command_o}, {'P', 2, command_p}, {'R', 1, command_r},
    {'W', 2, command_w},
};

void kteam_obey(robot_t *robot, const char *line)
{
    int32_t arguments[ARGUMENTS_MAX];
    char letter = *line++;
    unsigned i;

    if (letter == 'T') {
        if (!command_t(robot, line))
            robot_print(robot, PROTOCOL_ERROR);
        return;
    }
    for (i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        if (commands[i].letter != letter)
            continue;
        if (!arguments_are(line, arguments, commands[i].arguments) ||
            !commands[i].obey(robot, arguments))
            robot_print(robot, PROTOCOL_ERROR);
        return;
    }
    robot_print(robot, "z,Command not found\r\n");
}
