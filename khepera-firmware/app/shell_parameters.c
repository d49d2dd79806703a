/* Shell: parameters. */
#include <stddef.h>

#include "app/shell.h"
#include "app/shell_commands.h"

#define NAME_SIZE 48u

/* The first word of *arguments into name; *arguments is then what follows it. */
static void take_name(const char **arguments, char name[NAME_SIZE])
{
    const char *text = text_skip_blanks(*arguments);
    unsigned i = 0;

    for (; *text != '\0' && *text != ' '; text++)
        if (i + 1 < NAME_SIZE)
            name[i++] = *text;
    name[i] = '\0';
    *arguments = text_skip_blanks(text);
}

/* What stands between a value and its unit: some have none. */
static const char *gap(const parameter_t *parameter)
{
    return *parameter->unit == '\0' ? "" : " ";
}

void shell_print_parameter(const robot_t *robot, uint16_t index)
{
    const parameter_t *parameter = parameter_at(index);

    robot_print(robot, "%s = %d%s%s (%d..%d, default %d) %s\r\n", parameter->name,
                parameter_get(&robot->parameters, index), gap(parameter), parameter->unit,
                parameter->min, parameter->max, parameter->initial, parameter->text);
}

static void no_such(const robot_t *robot, const char *name)
{
    robot_print(robot, "error: no parameter '%s'; get lists them\r\n", name);
}

static int list_parameters(robot_t *robot, uint16_t index)
{
    if (index == parameter_count())
        return 0;
    if (text_begins(parameter_at(index)->name, robot->list_argument))
        shell_print_parameter(robot, index);
    return 1;
}

void shell_get(robot_t *robot, const char *arguments)
{
    uint16_t i;

    for (i = 0; i < parameter_count(); i++)
        if (text_begins(parameter_at(i)->name, arguments))
            break;
    if (i == parameter_count())
        no_such(robot, arguments);
    else
        robot_list(robot, list_parameters, arguments);
}

void shell_set(robot_t *robot, const char *arguments)
{
    char name[NAME_SIZE];
    const parameter_t *parameter;
    uint16_t index;
    int32_t value;

    take_name(&arguments, name);
    index = parameter_find(name);
    if (index == PARAMETER_NONE) {
        no_such(robot, name);
        return;
    }
    parameter = parameter_at(index);
    if (!text_number(&arguments, &value) || *arguments != '\0') {
        robot_print(robot, "error: %s needs one whole number; give %d..%d%s%s\r\n", name,
                    parameter->min, parameter->max, gap(parameter), parameter->unit);
        return;
    }
    if (!parameter_set(&robot->parameters, index, value)) {
        robot_print(robot, "error: %d is out of range; give %d..%d%s%s (%s)\r\n", value,
                    parameter->min, parameter->max, gap(parameter), parameter->unit,
                    parameter->text);
        return;
    }
    robot_print(robot, "ok: %s = %d%s%s\r\n", name, value, gap(parameter), parameter->unit);
}

void shell_save(robot_t *robot, const char *arguments)
{
    if (!shell_no_arguments(robot, arguments))
        return;
    if (robot->base->flash == NULL || !parameter_store_save(&robot->store, &robot->parameters)) {
        robot_print(robot, "error: this base has no flash for parameters; nothing was saved\r\n");
        return;
    }
    robot->saving = 1;
}

void shell_saved(robot_t *robot, int good)
{
    if (good)
        robot_print(robot, "ok: saved\r\n");
    else
        robot_print(robot, "error: the flash did not take both copies; save again, and if it fails "
                           "again, the flash is worn out\r\n");
}

void shell_defaults(robot_t *robot, const char *arguments)
{
    char name[NAME_SIZE];
    uint16_t index;

    if (*arguments == '\0') {
        parameters_default(&robot->parameters);
        robot_print(robot, "ok: all parameters at their defaults; save keeps them\r\n");
        return;
    }
    take_name(&arguments, name);
    index = parameter_find(name);
    if (index == PARAMETER_NONE) {
        no_such(robot, name);
        return;
    }
    (void)parameter_set(&robot->parameters, index, parameter_at(index)->initial);
    robot_print(robot, "ok: %s = %d%s%s\r\n", name, parameter_at(index)->initial,
                gap(parameter_at(index)), parameter_at(index)->unit);
}

static int is_changed(const robot_t *robot, uint16_t index)
{
    return parameter_get(&robot->parameters, index) != parameter_at(index)->initial;
}

static int list_changed(robot_t *robot, uint16_t index)
{
    if (index == parameter_count())
        return 0;
    if (is_changed(robot, index))
        shell_print_parameter(robot, index);
    return 1;
}

void shell_diff(robot_t *robot, const char *arguments)
{
    uint16_t i;

    if (!shell_no_arguments(robot, arguments))
        return;
    for (i = 0; i < parameter_count(); i++)
        if (is_changed(robot, i))
            break;
    if (i < parameter_count())
        robot_list(robot, list_changed, arguments);
    else
        robot_print(robot, "ok: all parameters are at their defaults\r\n");
}
