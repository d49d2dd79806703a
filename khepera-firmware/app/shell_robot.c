/* Shell: the robot itself. */
#include <stddef.h>

#include "app/shell_commands.h"
#include "board/khepera.h"

static const char *turret_state(const robot_t *robot)
{
    if (robot->silent_ticks >= ROBOT_REPORT_TIMEOUT_TICKS)
        return "silent: is its FPGA configured?";
    if (robot->report.function == FPGA_FUNCTION_SOCCER)
        return "soccer";
    return robot->report.function == FPGA_FUNCTION_CAPTURE ? "capture: it finds no objects"
                                                           : "unknown";
}

static const char *state_name(const robot_t *robot)
{
    static const char *const modes[] = {"stopped", "PWM", "speed control", "position control"};

    if (robot->emergency)
        return "emergency stop; estop clear releases it";
    if (robot->playing)
        return soccer_state_name(&robot->soccer);
    return modes[robot->motion.wheel[0].mode];
}

/* ---- status, line by line ---- */

static void status_state(const robot_t *robot)
{
    robot_print(robot, "state: %s\r\n", state_name(robot));
}

static void status_pose(const robot_t *robot)
{
    robot_pose_t pose = robot_pose(robot);

    robot_print(robot, "pose: x %d mm, y %d mm, heading %d deg", pose.x_mm, pose.y_mm,
                pose.heading_deg10 / 10);
    if (robot->playing)
        robot_print(robot, ", +-%d mm", world_position_sigma_mm(&robot->soccer.world));
    robot_print(robot, "\r\n");
}

static void status_ball(const robot_t *robot)
{
    const object_t *ball = &robot->soccer.world.ball;

    if (robot->playing && ball->known)
        robot_print(robot, "ball: x %d mm, y %d mm, seen %d ms ago\r\n", ball->x_q4 / 16,
                    ball->y_q4 / 16, ball->age_ticks * 10);
    else
        robot_print(robot, "ball: not known\r\n");
}

static void status_wheels(const robot_t *robot)
{
    robot_print(robot, "wheels: %d and %d mm/s\r\n", motion_measured_mm_s(&robot->motion, 0),
                motion_measured_mm_s(&robot->motion, 1));
}

static void status_turret(const robot_t *robot)
{
    robot_print(robot, "turret: %s\r\nreports: %u good, %d damaged, %d stale, %d lost\r\n",
                turret_state(robot), robot->reports, robot->bad_reports, robot->stale_reports,
                robot->base->reports_lost(robot->base->context));
}

static void status_battery(const robot_t *robot)
{
    if (robot->sensors.silent)
        robot_print(robot, "battery: not known\r\n");
    else
        robot_print(robot, "battery: %d mV%s\r\n", robot_battery_mv(robot),
                    robot->battery_low ? ", low" : "");
}

static void status_system(const robot_t *robot)
{
    robot_print(robot, "up: %u s since reset by %s\r\ncpu: %d %% busy\r\n", robot->ticks / 100u,
                robot->base->reset_cause, robot->tasks.load_percent);
}

static void status_stack(const robot_t *robot)
{
    const base_t *base = robot->base;

    robot_print(robot, "stack: %u of %u bytes used\r\nconsole: %d characters lost\r\n",
                base->stack_used(base->context), base->stack_size,
                base->console_lost(base->context));
}

static void status_faults(const robot_t *robot)
{
    if (robot->motion.fault & MOTION_FAULT_LEFT)
        robot_print(robot, "fault: left wheel does not turn\r\n");
    if (robot->motion.fault & MOTION_FAULT_RIGHT)
        robot_print(robot, "fault: right wheel does not turn\r\n");
    if (robot->sensors.silent)
        robot_print(robot, "fault: A/D converter does not answer\r\n");
    if (robot->base->crash(robot->base->context) != NULL)
        robot_print(robot, "crash: there was one; crash show tells of it\r\n");
}

static int list_status(robot_t *robot, uint16_t index)
{
    static void (*const lines[])(const robot_t *robot) = {
        status_state,   status_pose,   status_ball,  status_wheels, status_turret,
        status_battery, status_system, status_stack, status_faults};

    if (index >= sizeof lines / sizeof lines[0])
        return 0;
    lines[index](robot);
    return 1;
}

void shell_status(robot_t *robot, const char *arguments)
{
    if (shell_no_arguments(robot, arguments))
        robot_list(robot, list_status, arguments);
}

static void print_build(const robot_t *robot, const uint8_t *id)
{
    unsigned i;

    for (i = 0; i < 8; i++)
        robot_print(robot, "%02x", id[i]);
}

void shell_version(robot_t *robot, const char *arguments)
{
    if (!shell_no_arguments(robot, arguments))
        return;
    robot_print(robot, "StereoSot base, build ");
    print_build(robot, robot->base->build_id);
    robot_print(robot,
                "\r\nprotocol: that of a Khepera II\r\nboard: 68331 at %u Hz, wheels %d counts/mm, "
                "%d mm apart\r\n",
                (uint32_t)BOARD_SYSTEM_HZ, BOARD_PULSES_PER_MM, BOARD_WHEEL_BASE_MM);
}

void shell_tasks(robot_t *robot, const char *arguments)
{
    const base_t *base = robot->base;
    const char *rest;
    unsigned i;

    if (text_word(arguments, "clear", &rest) && *rest == '\0') {
        tasks_clear(&robot->tasks);
        robot_print(robot, "ok: worst times forgotten\r\n");
        return;
    }
    if (!shell_no_arguments(robot, arguments))
        return;
    for (i = 0; i < TASK_COUNT; i++)
        robot_print(robot, "%-8s %9u runs, last %5d us, worst %5d us\r\n", task_name((task_t)i),
                    robot->tasks.task[i].runs, TASK_US(robot->tasks.task[i].last_fine),
                    TASK_US(robot->tasks.task[i].worst_fine));
    robot_print(robot, "late ticks %u, cpu %d %% busy\r\n", robot->tasks.late_ticks,
                robot->tasks.load_percent);
    robot_print(robot, "stack %u of %u bytes at most\r\n", base->stack_used(base->context),
                base->stack_size);
}

void shell_start(robot_t *robot, const char *arguments)
{
    int32_t heading_deg;

    if (!text_number(&arguments, &heading_deg) || *arguments != '\0' || heading_deg < -180 ||
        heading_deg > 180) {
        robot_print(robot, "error: start needs the robot's heading; give whole degrees -180..180, "
                           "0 = towards the opponent's goal\r\n");
        return;
    }
    if (robot_play(robot, angle_from_degrees(heading_deg)))
        robot_print(robot, "ok: playing, heading %d\r\n", heading_deg);
    else
        robot_print(robot, "error: emergency stop; estop clear releases it\r\n");
}

void shell_run(robot_t *robot, const char *arguments)
{
    const char *heading;

    if (text_word(arguments, "soccer", &heading))
        shell_start(robot, heading);
    else
        robot_print(robot, "error: no such program; list names them\r\n");
}

void shell_stop(robot_t *robot, const char *arguments)
{
    if (!shell_no_arguments(robot, arguments))
        return;
    robot_stop(robot);
    robot_print(robot, "ok: stopped\r\n");
}

/* The word itself has stopped the robot when its last letter came in. */
void shell_estop(robot_t *robot, const char *arguments)
{
    const char *rest;

    if (text_word(arguments, "clear", &rest) && *rest == '\0') {
        robot->emergency = 0;
        robot_print(robot, "ok: released\r\n");
    } else if (shell_no_arguments(robot, arguments)) {
        robot_print(robot, "ok: emergency stop; estop clear releases it\r\n");
    }
}

void shell_pose(robot_t *robot, const char *arguments)
{
    const char *rest;
    robot_pose_t pose;

    if (text_word(arguments, "clear", &rest) && *rest == '\0') {
        base_pose_reset(&robot->pose);
        robot_print(robot, "ok: here is the origin\r\n");
        return;
    }
    if (!shell_no_arguments(robot, arguments))
        return;
    pose = robot_pose(robot);
    robot_print(robot, "x_mm %d y_mm %d heading_deg10 %d\r\n", pose.x_mm, pose.y_mm,
                pose.heading_deg10);
}

void shell_list(robot_t *robot, const char *arguments)
{
    if (shell_no_arguments(robot, arguments))
        robot_print(robot, "soccer\r\n");
}

void shell_net(robot_t *robot, const char *arguments)
{
    if (shell_no_arguments(robot, arguments))
        robot_print(robot, "%d vision, %s\r\n", BOARD_TURRET_ID, turret_state(robot));
}

void shell_k_team(robot_t *robot, const char *arguments)
{
    if (shell_no_arguments(robot, arguments))
        robot_print(robot, "The Khepera is K-Team's; this program is StereoSot's\r\n");
}

static void reset_into(robot_t *robot, base_restart_t how)
{
    robot_stop(robot);
    robot->restart = (uint8_t)(1u + how);
}

void shell_restart(robot_t *robot, const char *arguments)
{
    if (!shell_no_arguments(robot, arguments))
        return;
    robot_print(robot, "ok: restart\r\n");
    reset_into(robot, BASE_RESTART);
}

void shell_loader(robot_t *robot, const char *arguments)
{
    if (!shell_no_arguments(robot, arguments))
        return;
    robot_print(robot, "ok: loader\r\n");
    reset_into(robot, BASE_LOADER);
}
