/* The shell beside K-Team's protocol: lower-case words for people and programs.
 *
 * A command answers with one line `ok: ...`, with the lines it lists, or with one line
 * `error: cause; cure`. docs/SPEC.md lists them. */
#ifndef APP_SHELL_H
#define APP_SHELL_H

#include "app/robot.h"

/* Obey a line (not empty). */
void shell_obey(robot_t *robot, const char *line);

/* A save has ended: the answer of `save`. */
void shell_saved(robot_t *robot, int good);

/* For line_terminal_t: what may stand at line[word..]. `context` is the robot. */
const char *shell_candidate(void *context, const char *line, unsigned word, unsigned index);

#endif
