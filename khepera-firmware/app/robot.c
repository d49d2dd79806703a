#include "app/robot.h"

#include "app/text.h"

#define REPLY_SIZE 100u
/* Console characters a poll: a flood may not starve the control loop. */
#define READ_MAX   32

static void say(const robot_t *robot, const char *string)
{
    for (; *string != '\0'; string++)
        (void)robot->base->console_write(robot->base->context, (uint8_t)*string);
}

static void say_line(const robot_t *robot, const char *string)
{
    say(robot, string);
    say(robot, "\r\n");
}

/* ---- Console commands: each gets what follows its name ---- */

static void command_help(robot_t *robot, const char *rest);
static void command_status(robot_t *robot, const char *rest);
static void command_start(robot_t *robot, const char *rest);
static void command_stop(robot_t *robot, const char *rest);

static const struct {
    const char *name;
    void (*run)(robot_t *robot, const char *rest);
    const char *help;
} commands[] = {
    {"help", command_help, "help            this list"},
    {"status", command_status, "status          state, pose, ball, reports, faults"},
    {"start", command_start,
     "start HEADING   play; HEADING = where the robot faces, degrees -180..180,\r\n"
     "                0 = towards the opponent's goal, positive = turned left"},
    {"stop", command_stop, "stop            motors off, wait for the next start"},
};
#define COMMAND_COUNT (sizeof commands / sizeof commands[0])

static void command_help(robot_t *robot, const char *rest)
{
    unsigned i;

    (void)rest;
    for (i = 0; i < COMMAND_COUNT; i++)
        say_line(robot, commands[i].help);
}

static void halt(robot_t *robot)
{
    motion_halt(&robot->motion);
    robot->base->motors(robot->base->context, 0, 0);
}

static void command_start(robot_t *robot, const char *rest)
{
    char reply[REPLY_SIZE];
    text_t text;
    int32_t heading_deg;

    if (!console_number(rest, &heading_deg) || heading_deg < -180 || heading_deg > 180) {
        say_line(robot, "error: start needs the robot's heading; give whole degrees -180..180, "
                        "0 = towards the opponent's goal");
        return;
    }
    soccer_start(&robot->soccer, angle_from_degrees(heading_deg));
    robot->playing = 1;
    text_begin(&text, reply, sizeof reply);
    text_add(&text, "ok: playing, heading ");
    text_add_decimal(&text, heading_deg);
    say_line(robot, reply);
}

static void command_stop(robot_t *robot, const char *rest)
{
    (void)rest;
    robot->playing = 0;
    halt(robot);
    say_line(robot, "ok: stopped");
}

static void say_number(const robot_t *robot, const char *before, int32_t value, const char *after)
{
    char number[12];
    text_t text;

    text_begin(&text, number, sizeof number);
    text_add_decimal(&text, value);
    say(robot, before);
    say(robot, number);
    say(robot, after);
}

static const char *function_name(const robot_t *robot)
{
    if (robot->silent_ticks >= ROBOT_REPORT_TIMEOUT_TICKS)
        return "silent: is its FPGA configured?";
    if (robot->function == FPGA_FUNCTION_SOCCER)
        return "soccer";
    return robot->function == FPGA_FUNCTION_CAPTURE ? "capture: it finds no objects" : "unknown";
}

static void say_belief(const robot_t *robot)
{
    const soccer_t *soccer = &robot->soccer;
    pose_t pose;

    odometry_pose(&soccer->world.odometry, &pose);
    say_number(robot, "pose: x ", pose.x_q4 / 16, " mm");
    say_number(robot, ", y ", pose.y_q4 / 16, " mm");
    say_number(robot, ", heading ", angle_to_degrees(pose.heading), " deg");
    say_number(robot, ", +-", world_position_sigma_mm(&soccer->world), " mm\r\n");
    if (soccer->world.ball.known) {
        say_number(robot, "ball: x ", soccer->world.ball.x_q4 / 16, " mm");
        say_number(robot, ", y ", soccer->world.ball.y_q4 / 16, " mm");
        say_number(robot, ", seen ", soccer->world.ball.age_ticks * 10, " ms ago\r\n");
    } else {
        say_line(robot, "ball: not known");
    }
}

static void command_status(robot_t *robot, const char *rest)
{
    const base_t *base = robot->base;
    char crash[REPLY_SIZE];

    (void)rest;
    say(robot, "state: ");
    say_line(robot, robot->playing ? soccer_state_name(&robot->soccer) : "stopped");
    say_belief(robot);
    say(robot, "turret: ");
    say_line(robot, function_name(robot));
    say_number(robot, "reports: ", (int32_t)robot->reports, " good");
    say_number(robot, ", ", robot->bad_reports, " damaged");
    say_number(robot, ", ", base->reports_lost(base->context), " lost\r\n");
    say_number(robot, "up: ", (int32_t)(robot->ticks / 100), " s since reset by ");
    say_line(robot, base->reset_cause);
    say_number(robot, "stack: ", (int32_t)base->stack_used(base->context), " bytes used\r\n");
    say_number(robot, "console: ", base->console_lost(base->context), " characters lost\r\n");
    if (base->crash(base->context, crash, sizeof crash)) {
        say(robot, "crash: ");
        say_line(robot, crash);
    }
}

static void obey(robot_t *robot)
{
    const char *rest;
    unsigned i;

    for (i = 0; i < COMMAND_COUNT; i++) {
        if (console_word(robot->console.line, commands[i].name, &rest)) {
            commands[i].run(robot, rest);
            return;
        }
    }
    say_line(robot, "error: no such command; help lists them");
}

static void poll_console(robot_t *robot)
{
    unsigned i;

    for (i = 0; i < READ_MAX; i++) {
        int character = robot->base->console_read(robot->base->context);

        if (character < 0)
            return;
        switch (console_take(&robot->console, (uint8_t)character)) {
        case CONSOLE_LINE:
            obey(robot);
            break;
        case CONSOLE_TOO_LONG:
            say_line(robot, "error: line too long; give at most 79 characters");
            break;
        case CONSOLE_NOTHING:
            break;
        }
    }
}

/* ---- Play ---- */

/* Set the wheels' commands as soccer wants them now. Returns 0 if the motors must be off. */
static int steer(robot_t *robot)
{
    wheels_t wheels = {0, 0};

    if (!robot->playing)
        return 0;
    if (robot->silent_ticks >= ROBOT_BLIND_SEARCH_TICKS)
        soccer_search_blind(&robot->soccer, &wheels);
    else if (robot->silent_ticks >= ROBOT_REPORT_TIMEOUT_TICKS)
        return 0;
    else
        soccer_wheels(&robot->soccer, &wheels);
    motion_command(&robot->motion, wheels.left_mm_s, wheels.right_mm_s);
    return 1;
}

static void take_report(robot_t *robot)
{
    uint8_t wire[REPORT_SIZE];
    uint16_t age_100us;
    report_t report;
    int16_t duty[2];

    if (!robot->base->report(robot->base->context, wire, &age_100us))
        return;
    if (report_decode(wire, &report) != REPORT_OK) {
        if (robot->bad_reports < UINT16_MAX)
            robot->bad_reports++;
        return;
    }
    /* A turret that shows one report again and again has stopped seeing. */
    if (robot->reports > 0 && report.sequence == robot->sequence)
        return;
    robot->sequence = report.sequence;
    robot->reports++;
    robot->silent_ticks = 0;
    robot->function = report.function;
    if (!robot->playing)
        return;
    soccer_see(&robot->soccer, &report, age_100us);
    if (steer(robot)) {
        motion_refresh(&robot->motion, duty);
        robot->base->motors(robot->base->context, duty[0], duty[1]);
    }
}

void robot_init(robot_t *robot, const base_t *base)
{
    robot->base = base;
    console_init(&robot->console);
    motion_init(&robot->motion);
    robot->tuning = soccer_tuning_default;
    soccer_init(&robot->soccer, &robot->tuning);
    base->encoders(base->context, robot->counts);
    robot->ticks = 0;
    robot->reports = 0;
    robot->sequence = 0;
    robot->bad_reports = 0;
    robot->silent_ticks = ROBOT_BLIND_SEARCH_TICKS;
    robot->function = FPGA_FUNCTION_NONE;
    robot->playing = 0;
    halt(robot);
    say_line(robot, "StereoSot base, ready; help lists the commands");
}

void robot_tick(robot_t *robot)
{
    const base_t *base = robot->base;
    int32_t counts[2];
    int32_t moved[2];
    int16_t duty[2];
    unsigned i;

    base->encoders(base->context, counts);
    for (i = 0; i < 2; i++) {
        /* Unsigned: the counters wrap. */
        moved[i] = (int32_t)((uint32_t)counts[i] - (uint32_t)robot->counts[i]);
        robot->counts[i] = counts[i];
    }
    robot->ticks++;
    if (robot->silent_ticks < UINT16_MAX)
        robot->silent_ticks++;

    soccer_tick(&robot->soccer, moved);
    if (steer(robot)) {
        motion_step(&robot->motion, moved, duty);
        base->motors(base->context, duty[0], duty[1]);
    } else {
        halt(robot);
    }
    base->leds(
        base->context,
        (uint8_t)(robot->playing | (robot->soccer.world.ball.known && robot->playing ? 2u : 0u)));
}

void robot_poll(robot_t *robot)
{
    poll_console(robot);
    take_report(robot);
}
