/* Shell: looking inside, and the line itself. */
#include <stddef.h>

#include "app/kteam.h"
#include "app/shell_commands.h"

#define TICKS_PER_SECOND 100

static void print_log_line(const robot_t *robot, const log_line_t *line)
{
    robot_print(robot, "[%u.%03u %s %s] %s\r\n", line->time_ms / 1000u, line->time_ms % 1000u,
                log_module_name((log_module_t)line->module),
                log_level_name((log_level_t)line->level), line->text);
}

static int list_log(robot_t *robot, uint16_t index)
{
    uint32_t oldest = robot->log.written > LOG_LINES ? robot->log.written - LOG_LINES : 0;
    const log_line_t *line = log_line(&robot->log, oldest + index);

    if (line == NULL || index >= LOG_LINES)
        return 0;
    print_log_line(robot, line);
    return 1;
}

static void list_levels(const robot_t *robot)
{
    unsigned i;

    for (i = 0; i < LOG_MODULE_COUNT; i++)
        robot_print(robot, "%-8s %s\r\n", log_module_name((log_module_t)i),
                    log_level_name((log_level_t)robot->log.level[i]));
    robot_print(robot, "live     %s\r\n", robot->log_live ? "on" : "off");
}

static void set_level(robot_t *robot, const char *arguments)
{
    const char *rest = NULL;
    const char *end = NULL;
    unsigned module;
    unsigned level;

    for (module = 0; module < LOG_MODULE_COUNT; module++)
        if (text_word(arguments, log_module_name((log_module_t)module), &rest))
            break;
    for (level = 0; module < LOG_MODULE_COUNT && level < LOG_LEVEL_COUNT; level++)
        if (text_word(rest, log_level_name((log_level_t)level), &end) && *end == '\0')
            break;
    if (module == LOG_MODULE_COUNT || level == LOG_LEVEL_COUNT) {
        robot_print(robot,
                    "error: '%s' is not a module and a level; log lists the modules, levels "
                    "are off error warn info debug\r\n",
                    arguments);
        return;
    }
    robot->log.level[module] = (uint8_t)level;
    robot_print(robot, "ok: log %s %s\r\n", log_module_name((log_module_t)module),
                log_level_name((log_level_t)level));
}

void shell_log(robot_t *robot, const char *arguments)
{
    const char *rest;

    if (*arguments == '\0') {
        list_levels(robot);
    } else if (text_equal(arguments, "show")) {
        robot_list(robot, list_log, arguments);
    } else if (text_word(arguments, "live", &rest) &&
               (text_equal(rest, "on") || text_equal(rest, "off"))) {
        robot->log_live = (uint8_t)text_equal(rest, "on");
        robot->log.shown = robot->log.written;
        robot_print(robot, "ok: log live %s\r\n", rest);
    } else {
        set_level(robot, arguments);
    }
}

/* ---- stream ---- */

static int32_t find_variable(const char **arguments)
{
    unsigned i;
    const char *name;

    for (i = 0; (name = telemetry_name(i)) != NULL; i++) {
        const char *text = *arguments;

        if (!text_begins(text, name))
            continue;
        while (*name != '\0') {
            name++;
            text++;
        }
        if (*text != ',' && *text != ' ' && *text != '\0')
            continue;
        *arguments = text;
        return (int32_t)i;
    }
    return -1;
}

static int list_variables(robot_t *robot, uint16_t index)
{
    if (telemetry_name(index) == NULL)
        return 0;
    robot_print(robot, "%-18s %s\r\n", telemetry_name(index), telemetry_text(index));
    return 1;
}

static void refuse_stream(const robot_t *robot, const char *at)
{
    robot_print(robot,
                "error: cannot make sense of '%s'; give up to %u variables with commas between "
                "and 1..%u Hz, e.g. stream left.speed_mm_s,right.speed_mm_s 20\r\n",
                at, TELEMETRY_VARIABLES_MAX, TELEMETRY_HZ_MAX);
}

/* VAR[,VAR...] HZ; commas or blanks between the variables. Returns 0 after an error's answer. */
static int read_stream(robot_t *robot, const char *arguments, telemetry_t *wanted, int32_t *hz)
{
    wanted->count = 0;
    while (!text_number(&arguments, hz)) {
        int32_t variable = find_variable(&arguments);

        if (variable < 0 || wanted->count == TELEMETRY_VARIABLES_MAX) {
            refuse_stream(robot, arguments);
            return 0;
        }
        wanted->variable[wanted->count++] = (uint8_t)variable;
        while (*arguments == ',' || *arguments == ' ')
            arguments++;
    }
    if (wanted->count == 0 || *arguments != '\0' || *hz < 1 || *hz > (int32_t)TELEMETRY_HZ_MAX) {
        refuse_stream(robot, arguments);
        return 0;
    }
    return 1;
}

static void begin_stream(robot_t *robot, const char *arguments)
{
    telemetry_t wanted;
    int32_t hz;
    unsigned i;

    if (!read_stream(robot, arguments, &wanted, &hz))
        return;
    wanted.period_ticks = (uint16_t)(TICKS_PER_SECOND / hz);
    wanted.wait_ticks = wanted.period_ticks;
    wanted.dropped = 0;
    robot->telemetry = wanted;
    robot_print(robot, "ok: stream time_ms");
    for (i = 0; i < wanted.count; i++)
        robot_print(robot, ",%s", telemetry_name(wanted.variable[i]));
    robot_print(robot, " every %d ms\r\n", wanted.period_ticks * 10);
}

void shell_stream(robot_t *robot, const char *arguments)
{
    if (*arguments == '\0') {
        robot_list(robot, list_variables, arguments);
    } else if (text_equal(arguments, "off")) {
        robot_print(robot, "ok: stream off, %u lines did not fit the line\r\n",
                    robot->telemetry.dropped);
        robot->telemetry.count = 0;
        robot->telemetry.dropped = 0;
    } else {
        begin_stream(robot, arguments);
    }
}

/* ---- crash ---- */

static const char *cause_name(uint8_t vector)
{
    static const char *const names[] = {
        [2] = "bus error",
        [3] = "address error",
        [4] = "illegal instruction",
        [5] = "division by zero",
        [6] = "CHK",
        [7] = "TRAPcc",
        [8] = "privilege",
        [9] = "trace",
        [10] = "line A",
        [11] = "line F",
        [12] = "hardware breakpoint",
        [14] = "format error",
        [15] = "uninitialised interrupt",
        [24] = "spurious interrupt",
    };

    if (vector < sizeof names / sizeof names[0] && names[vector] != NULL)
        return names[vector];
    if (vector >= 32 && vector < 48)
        return "TRAP";
    return "unexpected interrupt or exception";
}

static void show_crash(const robot_t *robot, const crash_record_t *record)
{
    unsigned i;

    robot_print(robot, "cause: vector %u, %s\r\n", (uint32_t)crash_vector(record),
                cause_name(crash_vector(record)));
    robot_print(robot, "pc: %08X, sr: %04X\r\nframe:", crash_pc(record),
                (uint32_t)record->frame[0]);
    for (i = 0; i < CRASH_FRAME_WORDS; i++)
        robot_print(robot, " %04X", (uint32_t)record->frame[i]);
    for (i = 0; i < 16; i++)
        robot_print(robot, "%s%c%d %08X", i % 8 == 0 ? "\r\n" : " ", i < 8 ? 'd' : 'a',
                    (int32_t)(i % 8), record->registers[i]);
    robot_print(robot, "\r\nbuild: ");
    for (i = 0; i < 8; i++)
        robot_print(robot, "%02x", (uint32_t)record->build_id[i]);
    robot_print(robot, "\r\n");
}

void shell_crash(robot_t *robot, const char *arguments)
{
    const base_t *base = robot->base;
    const crash_record_t *record = base->crash(base->context);

    if (text_equal(arguments, "clear")) {
        base->crash_clear(base->context);
        robot_print(robot, "ok: forgotten\r\n");
    } else if (!text_equal(arguments, "show")) {
        robot_print(robot, "error: crash needs to know what to do; give show or clear\r\n");
    } else if (record == NULL) {
        robot_print(robot, "ok: no crash since power-on or clear\r\n");
    } else {
        show_crash(robot, record);
    }
}

/* ---- The line ---- */

void shell_baud(robot_t *robot, const char *arguments)
{
    int32_t baud;

    if (!text_number(&arguments, &baud) || *arguments != '\0' || !parameter_baud_possible(baud)) {
        robot_print(robot, "error: baud needs a rate; give 9600, 19200, 38400 or 115200\r\n");
        return;
    }
    robot_print(robot, "ok: %d baud from now on; set serial.baud and save keep it\r\n", baud);
    robot->base->console_baud(robot->base->context, (uint32_t)baud);
}

void shell_shell(robot_t *robot, const char *arguments)
{
    if (!shell_no_arguments(robot, arguments))
        return;
    robot_print(robot, "ok: echo on; raw turns it off\r\n");
    line_editor_set_interactive(&robot->editor, 1);
}

void shell_raw(robot_t *robot, const char *arguments)
{
    if (!shell_no_arguments(robot, arguments))
        return;
    line_editor_set_interactive(&robot->editor, 0);
    robot_print(robot, "ok: raw\r\n");
}

void shell_k(robot_t *robot, const char *arguments)
{
    if (*arguments >= 'A' && *arguments <= 'Z')
        kteam_obey(robot, arguments);
    else
        robot_print(robot, "error: that is no line of K-Team's protocol; give e.g. k D,10,10\r\n");
}
