#include "app/shell.h"

#include <stddef.h>

#include "app/shell_commands.h"

typedef enum {
    WORDS_NONE,
    WORDS_COMMANDS,
    WORDS_PARAMETERS,
    WORDS_VARIABLES,
    WORDS_LOG,
    WORDS_REGISTERS
} words_t;

static const struct {
    const char *name;
    const char *arguments;
    const char *text;
    void (*run)(robot_t *robot, const char *arguments);
    words_t words; /* what its arguments are completed from */
} commands[] = {
    {"help", "[NAME]", "this list; of a command, a parameter, an FPGA register", shell_help,
     WORDS_COMMANDS},
    {"words", "[LINE]", "what may follow LINE, for programs that complete", shell_words,
     WORDS_COMMANDS},
    {"status", "", "state, pose, ball, turret, battery, faults", shell_status, WORDS_NONE},
    {"version", "", "build, protocol, board", shell_version, WORDS_NONE},
    {"start", "HEADING",
     "play; HEADING = where the robot faces, -180..180 deg, 0 = opponent's goal", shell_start,
     WORDS_NONE},
    {"stop", "", "motors off, wait for the next start", shell_stop, WORDS_NONE},
    {"estop", "[clear]", "motors off at once and until clear; works anywhere in a line",
     shell_estop, WORDS_NONE},
    {"pose", "[clear]", "odometry since it was cleared, mm and 0.1 deg", shell_pose, WORDS_NONE},
    {"get", "[NAME]", "parameters with unit, range and default; NAME may be a beginning", shell_get,
     WORDS_PARAMETERS},
    {"set", "NAME VALUE", "change a parameter until the next reset", shell_set, WORDS_PARAMETERS},
    {"save", "", "keep all parameters in flash", shell_save, WORDS_NONE},
    {"defaults", "[NAME]", "take the defaults again (save keeps them)", shell_defaults,
     WORDS_PARAMETERS},
    {"diff", "", "parameters that are not at their default", shell_diff, WORDS_NONE},
    {"fpga", "[get [NAME]|set NAME VALUE]",
     "registers of the turret's FPGA; NAME may be a beginning", shell_fpga, WORDS_REGISTERS},
    {"tasks", "[clear]", "worst times of the loop in us, CPU load, stack", shell_tasks, WORDS_NONE},
    {"log", "[show|live on|live off|MODULE LEVEL]",
     "newest lines; levels off error warn info debug", shell_log, WORDS_LOG},
    {"stream", "[VAR,VAR.. HZ|off]", "send variables 1..100 times a second; alone: which there are",
     shell_stream, WORDS_VARIABLES},
    {"crash", "show|clear", "what stands of the last crash", shell_crash, WORDS_NONE},
    {"baud", "RATE", "9600, 19200, 38400 or 115200, from the next character on", shell_baud,
     WORDS_NONE},
    {"shell", "", "echo, editing, history, completion (or press Tab)", shell_shell, WORDS_NONE},
    {"raw", "", "none of these: for programs", shell_raw, WORDS_NONE},
    {"k", "LINE", "a line of K-Team's protocol, for who wants to see what he types", shell_k,
     WORDS_NONE},
    {"list", "", "programs that run can start", shell_list, WORDS_NONE},
    {"run", "soccer HEADING", "the same as start HEADING", shell_run, WORDS_NONE},
    {"net", "", "turrets on the bus", shell_net, WORDS_NONE},
    {"k-team", "", "who made the robot", shell_k_team, WORDS_NONE},
    {"restart", "", "reset the base", shell_restart, WORDS_NONE},
    {"loader", "", "reset the base into its loader", shell_loader, WORDS_NONE},
};

#define COUNT        (sizeof commands / sizeof commands[0])
/* Names in a line of `words`: they fit whatever they are. */
#define WORDS_A_LINE 6u

int shell_no_arguments(const robot_t *robot, const char *arguments)
{
    if (*arguments == '\0')
        return 1;
    robot_print(robot, "error: nothing may follow this command; leave '%s' out\r\n", arguments);
    return 0;
}

static unsigned find(const char *line, const char **rest)
{
    unsigned i;

    for (i = 0; i < COUNT; i++)
        if (text_word(line, commands[i].name, rest))
            break;
    return i;
}

static void print_command(const robot_t *robot, unsigned i)
{
    robot_print(robot, "%-9s%-22s %s\r\n", commands[i].name, commands[i].arguments,
                commands[i].text);
}

static int list_commands(robot_t *robot, uint16_t index)
{
    if (index < COUNT)
        print_command(robot, index);
    else if (index == COUNT)
        robot_print(robot,
                    "Capitals are K-Team's protocol: A B C D E F G H I J K L N O P R T W\r\n");
    return index < COUNT;
}

void shell_help(robot_t *robot, const char *arguments)
{
    const char *rest;
    unsigned i;

    if (*arguments == '\0') {
        robot_list(robot, list_commands, arguments);
        return;
    }
    i = find(arguments, &rest);
    if (i < COUNT)
        print_command(robot, i);
    else if (parameter_find(arguments) != PARAMETER_NONE)
        shell_print_parameter(robot, parameter_find(arguments));
    else if (!shell_help_register(robot, arguments))
        robot_print(robot, "error: no command or parameter '%s'; help and get list them\r\n",
                    arguments);
}

void shell_obey(robot_t *robot, const char *line)
{
    const char *arguments = NULL;
    unsigned i = find(line, &arguments);

    if (i < COUNT)
        commands[i].run(robot, arguments);
    else
        robot_print(robot, "error: no such command; help lists them\r\n");
}

static const char *parameter_name(unsigned index)
{
    return index < parameter_count() ? parameter_at((uint16_t)index)->name : NULL;
}

static const char *log_word(unsigned index)
{
    if (index < LOG_MODULE_COUNT)
        return log_module_name((log_module_t)index);
    index -= LOG_MODULE_COUNT;
    return index < LOG_LEVEL_COUNT ? log_level_name((log_level_t)index) : NULL;
}

const char *shell_candidate(void *context, const char *line, unsigned word, unsigned index)
{
    const char *rest;
    unsigned command;

    (void)context;
    if (word == 0)
        return index < COUNT ? commands[index].name : NULL;
    command = find(line, &rest);
    switch (command < COUNT ? commands[command].words : WORDS_NONE) {
    case WORDS_COMMANDS:
        return index < COUNT ? commands[index].name : parameter_name((unsigned)(index - COUNT));
    case WORDS_PARAMETERS:
        return parameter_name(index);
    case WORDS_VARIABLES:
        return telemetry_name(index);
    case WORDS_LOG:
        return log_word(index);
    case WORDS_REGISTERS:
        return shell_register_name(index);
    case WORDS_NONE:
        break;
    }
    return NULL;
}

static int list_words(robot_t *robot, uint16_t index)
{
    const char *line = robot->list_argument;
    unsigned first = index * WORDS_A_LINE;
    unsigned i;

    if (shell_candidate(robot, line, *line != '\0', first) == NULL) {
        robot_print(robot, "ok: words\r\n");
        return 0;
    }
    robot_print(robot, "words:");
    for (i = first; i < first + WORDS_A_LINE; i++) {
        const char *name = shell_candidate(robot, line, *line != '\0', i);

        if (name == NULL)
            break;
        robot_print(robot, " %s", name);
    }
    robot_print(robot, "\r\n");
    return 1;
}

void shell_words(robot_t *robot, const char *arguments)
{
    robot_list(robot, list_words, arguments);
}
