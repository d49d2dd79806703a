/* Shell: the registers of the turret's FPGA. */
#include <stddef.h>

#include "app/shell_commands.h"
#include "link/registers.h"

static int can_be_written(const fpga_register_t *info)
{
    /* The way to USB is the FX2's. */
    return info->min <= info->max && info->address != FPGA_REG_STREAM;
}

/* The rest of `text` if it begins with `name`, where - stands for _ as well; else NULL. */
static const char *after_name(const char *text, const char *name)
{
    for (; *name != '\0'; name++, text++)
        if ((*text == '-' ? '_' : *text) != *name)
            return NULL;
    return text;
}

static const fpga_register_t *find(const char *text, const char **rest)
{
    unsigned i;

    for (i = 0; i < FPGA_REGISTER_COUNT; i++) {
        const char *end = after_name(text, fpga_registers[i].name);

        if (end == NULL || (*end != '\0' && *end != ' '))
            continue;
        *rest = text_skip_blanks(end);
        return &fpga_registers[i];
    }
    return NULL;
}

/* Whether the register's name begins with `beginning`. */
static int begins(const fpga_register_t *info, const char *beginning)
{
    const char *name = info->name;

    for (; *beginning != '\0'; beginning++, name++)
        if ((*beginning == '-' ? '_' : *beginning) != *name)
            return 0;
    return 1;
}

const char *shell_register_name(unsigned index)
{
    static const char *const verbs[] = {"get", "set"};

    if (index < 2)
        return verbs[index];
    index -= 2;
    return index < FPGA_REGISTER_COUNT ? fpga_registers[index].name : NULL;
}

static void print_value(const robot_t *robot, const fpga_register_t *info, uint16_t value)
{
    robot_print(robot, "%s = %u%s%s", info->name, (uint32_t)value, *info->unit ? " " : "",
                info->unit);
}

static void print_range(const robot_t *robot, const fpga_register_t *info)
{
    if (can_be_written(info))
        robot_print(robot, " (%u..%u, reset %u) %s\r\n", (uint32_t)info->min, (uint32_t)info->max,
                    (uint32_t)info->reset, info->text);
    else
        robot_print(robot, " (read only) %s\r\n", info->text);
}

int shell_help_register(const robot_t *robot, const char *name)
{
    const char *rest = NULL;
    const fpga_register_t *info = find(name, &rest);

    if (info == NULL || *rest != '\0')
        return 0;
    robot_print(robot, "fpga %s%s%s", info->name, *info->unit ? ", " : "", info->unit);
    print_range(robot, info);
    return 1;
}

static const fpga_register_t *asked_for(const robot_t *robot)
{
    unsigned i = 0;

    while (fpga_registers[i].address != robot->register_address)
        i++;
    return &fpga_registers[i];
}

static int turret_answered(robot_t *robot, const uint16_t *value)
{
    if (value != NULL)
        return 1;
    robot_print(robot, "error: the turret does not answer; is its FPGA configured?\r\n");
    robot->list = NULL;
    return 0;
}

static void answer_get(robot_t *robot, const uint16_t *value)
{
    if (!turret_answered(robot, value))
        return;
    print_value(robot, asked_for(robot), *value);
    print_range(robot, asked_for(robot));
}

static void answer_set(robot_t *robot, const uint16_t *value)
{
    const fpga_register_t *info = asked_for(robot);

    if (!turret_answered(robot, value))
        return;
    if (*value != robot->register_wanted) {
        robot_print(robot, "error: the FPGA did not take %u, %s is %u; %s\r\n",
                    (uint32_t)robot->register_wanted, info->name, (uint32_t)*value, info->text);
        return;
    }
    robot_print(robot, "ok: ");
    print_value(robot, info, *value);
    robot_print(robot, "\r\n");
}

static int list_registers(robot_t *robot, uint16_t index)
{
    if (index == FPGA_REGISTER_COUNT)
        return 0;
    if (begins(&fpga_registers[index], robot->list_argument))
        robot_register_read(robot, fpga_registers[index].address, answer_get);
    return 1;
}

static void no_such(const robot_t *robot, const char *name)
{
    robot_print(robot, "error: no register '%s'; fpga lists them\r\n", name);
}

static void get(robot_t *robot, const char *beginning)
{
    unsigned i;

    for (i = 0; i < FPGA_REGISTER_COUNT; i++)
        if (begins(&fpga_registers[i], beginning))
            break;
    if (i < FPGA_REGISTER_COUNT)
        robot_list(robot, list_registers, beginning);
    else
        no_such(robot, beginning);
}

static void set(robot_t *robot, const char *arguments)
{
    const char *text = NULL;
    const fpga_register_t *info = find(arguments, &text);
    int32_t value;

    if (info == NULL)
        no_such(robot, arguments);
    else if (!can_be_written(info))
        robot_print(robot, "error: %s can only be read; %s\r\n", info->name, info->text);
    else if (!text_number(&text, &value) || *text != '\0' || value < info->min || value > info->max)
        robot_print(robot, "error: %s takes one whole number; give %u..%u%s%s\r\n", info->name,
                    (uint32_t)info->min, (uint32_t)info->max, *info->unit ? " " : "", info->unit);
    else
        robot_register_write(robot, info->address, (uint16_t)value, answer_set);
}

void shell_fpga(robot_t *robot, const char *arguments)
{
    const char *rest;

    if (text_word(arguments, "set", &rest))
        set(robot, rest);
    else if (text_word(arguments, "get", &rest) || *(rest = arguments) == '\0')
        get(robot, rest);
    else
        robot_print(robot,
                    "error: fpga does not know '%s'; give get, get NAME or set NAME VALUE\r\n",
                    arguments);
}
