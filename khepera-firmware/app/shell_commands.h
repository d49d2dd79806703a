/* The shell's commands: each gets what follows its name. For app/shell*.c only. */
#ifndef APP_SHELL_COMMANDS_H
#define APP_SHELL_COMMANDS_H

#include "app/robot.h"

/* shell.c */
void shell_help(robot_t *robot, const char *arguments);
void shell_words(robot_t *robot, const char *arguments);
/* "error: CAUSE; CURE" for a command that takes nothing. Returns 1 if `arguments` is empty. */
int shell_no_arguments(const robot_t *robot, const char *arguments);

/* shell_robot.c */
void shell_status(robot_t *robot, const char *arguments);
void shell_version(robot_t *robot, const char *arguments);
void shell_tasks(robot_t *robot, const char *arguments);
void shell_start(robot_t *robot, const char *arguments);
void shell_run(robot_t *robot, const char *arguments);
void shell_stop(robot_t *robot, const char *arguments);
void shell_estop(robot_t *robot, const char *arguments);
void shell_pose(robot_t *robot, const char *arguments);
void shell_list(robot_t *robot, const char *arguments);
void shell_net(robot_t *robot, const char *arguments);
void shell_k_team(robot_t *robot, const char *arguments);
void shell_restart(robot_t *robot, const char *arguments);
void shell_loader(robot_t *robot, const char *arguments);

/* shell_parameters.c */
void shell_get(robot_t *robot, const char *arguments);
void shell_set(robot_t *robot, const char *arguments);
void shell_save(robot_t *robot, const char *arguments);
void shell_defaults(robot_t *robot, const char *arguments);
void shell_diff(robot_t *robot, const char *arguments);
/* One parameter with unit, range and default. */
void shell_print_parameter(const robot_t *robot, uint16_t index);

/* shell_fpga.c */
void shell_fpga(robot_t *robot, const char *arguments);
/* What may follow `fpga`: NULL after the last. */
const char *shell_register_name(unsigned index);
/* Tells of the register of that name; 0 if there is none. */
int shell_help_register(const robot_t *robot, const char *name);

/* shell_debug.c */
void shell_log(robot_t *robot, const char *arguments);
void shell_stream(robot_t *robot, const char *arguments);
void shell_crash(robot_t *robot, const char *arguments);
void shell_baud(robot_t *robot, const char *arguments);
void shell_raw(robot_t *robot, const char *arguments);
void shell_shell(robot_t *robot, const char *arguments);
void shell_k(robot_t *robot, const char *arguments);

#endif
