/* K-Team's serial protocol: what clients of a Khepera speak.
 *
 * A line is a capital and decimals after commas; the answer is the small letter and values, or "z,"
 * and a text, ended by CR LF. docs/SPEC.md lists the commands and says which of them K-Team's
 * documents define and which are ours. */
#ifndef APP_KTEAM_H
#define APP_KTEAM_H

#include "app/robot.h"

/* Obey a line (not empty) and answer it. */
void kteam_obey(robot_t *robot, const char *line);

#endif
