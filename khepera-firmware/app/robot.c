#include "app/robot.h"

#include <stddef.h>

#include "app/kteam.h"
#include "app/seldom.h"
#include "app/shell.h"

/* Console characters a poll: a flood may not starve the control loop. */
#define READ_MAX        64
/* The converter's readings are renewed so often. */
#define SENSOR_TICKS    2u
#define LED_PLAYING     1u
#define LED_BALL        2u
#define MS_PER_TICK     10u
/* Below the threshold for so long: a motor's start pulls the battery down for less. */
#define BATTERY_LOW_MAX 25u
/* Room that live log lines and streamed lines leave to answers. */
#define BACKGROUND_ROOM (ROBOT_REPLY_ROOM + 1024u)

static uint16_t now_fine(const robot_t *robot)
{
    return robot->base->fine(robot->base->context);
}

/* ---- Console ---- */

static void put_character(void *context, char character)
{
    const robot_t *robot = context;

    robot->base->console_write(robot->base->context, &character, 1);
}

void robot_print(const robot_t *robot, const char *format, ...)
{
    char buffer[ROBOT_PRINT_MAX + 1];
    va_list arguments;
    text_t text;

    text_begin(&text, buffer, sizeof buffer);
    va_start(arguments, format);
    text_add_arguments(&text, format, arguments);
    va_end(arguments);
    robot->base->console_write(robot->base->context, buffer, text.used);
}

void robot_list(robot_t *robot, robot_list_t list, const char *argument)
{
    robot->list = list;
    robot->list_next = 0;
    robot->list_argument = argument;
}

static int has_room(const robot_t *robot, uint32_t room)
{
    return robot->base->console_room(robot->base->context) >= room;
}

/* ---- Safety ---- */

static void motors_off(robot_t *robot)
{
    motion_off(&robot->motion);
    robot->base->motors(robot->base->context, 0, 0);
}

void robot_stop(robot_t *robot)
{
    robot->playing = 0;
    motors_off(robot);
}

/* The interrupt has turned the motors off already; they have to stay off. */
static void heed_stop_word(robot_t *robot)
{
    if (!robot->base->stop_word(robot->base->context))
        return;
    robot_stop(robot);
    if (!robot->emergency)
        log_write(&robot->log, LOG_SYSTEM, LOG_WARN, "emergency stop");
    robot->emergency = 1;
}

int robot_take_over(robot_t *robot)
{
    if (robot->emergency)
        return 0;
    if (robot->playing) {
        log_write(&robot->log, LOG_SYSTEM, LOG_INFO, "play ended by a motion command");
        robot_stop(robot);
    }
    return 1;
}

int robot_play(robot_t *robot, angle_t heading)
{
    if (robot->emergency)
        return 0;
    motion_off(&robot->motion);
    soccer_start(&robot->soccer, heading);
    robot->playing = 1;
    log_write(&robot->log, LOG_SYSTEM, LOG_INFO, "play");
    return 1;
}

SELDOM static void tell_faults(robot_t *robot)
{
    uint8_t fault = motion_take_fault(&robot->motion);

    if (fault & MOTION_FAULT_LEFT)
        log_write(&robot->log, LOG_MOTION, LOG_WARN, "left wheel does not turn: motors off");
    if (fault & MOTION_FAULT_RIGHT)
        log_write(&robot->log, LOG_MOTION, LOG_WARN, "right wheel does not turn: motors off");
}

/* ---- Console lines ---- */

static void obey(robot_t *robot, line_event_t event)
{
    const char *line = robot->editor.text;
    int shell = *line >= 'a' && *line <= 'z';

    heed_stop_word(robot);
    if (event != LINE_WHOLE && !shell) {
        robot_print(robot, "z,Protocol error\r\n");
    } else if (event == LINE_TOO_LONG) {
        robot_print(robot, "error: line too long; give at most %u characters\r\n", LINE_MAX_LENGTH);
    } else if (event == LINE_DAMAGED) {
        robot_print(robot,
                    "error: a character of that line was lost on the way; send it again\r\n");
    } else if (shell) {
        shell_obey(robot, line);
    } else {
        kteam_obey(robot, line);
    }
    if (!robot->saving && robot->list == NULL && robot->register_answer == NULL)
        line_editor_prompt(&robot->editor);
}

/* One line of the list under way. Returns 1 if there may be more. */
static int go_on_with_list(robot_t *robot)
{
    if (robot->list == NULL || robot->register_answer != NULL || !has_room(robot, ROBOT_REPLY_ROOM))
        return 0;
    if (robot->list(robot, robot->list_next++))
        return 1;
    robot->list = NULL;
    line_editor_prompt(&robot->editor);
    return 1;
}

/* Returns 1 if there may be more. */
static int poll_console(robot_t *robot)
{
    unsigned i;

    for (i = 0; i < READ_MAX; i++) {
        line_event_t event;
        int character;

        if (robot->saving || robot->list != NULL || robot->register_answer != NULL ||
            robot->restart != 0 || !has_room(robot, ROBOT_REPLY_ROOM))
            return 0; /* goes on when the queue has been sent */
        character = robot->base->console_read(robot->base->context);
        if (character < 0)
            return 0;
        event = line_editor_take(&robot->editor, (uint8_t)character);
        if (event != LINE_NOTHING) {
            obey(robot, event);
            return 1;
        }
    }
    return 1;
}

static int step_save(robot_t *robot)
{
    store_result_t result;

    if (!robot->saving)
        return 0;
    result = parameter_store_step(&robot->store);
    if (result == STORE_BUSY)
        return 0; /* a step a poll: there are many, and control comes first */
    robot->saving = 0;
    shell_saved(robot, result == STORE_DONE);
    line_editor_prompt(&robot->editor);
    return 1;
}

void robot_register_read(robot_t *robot, uint8_t address, robot_register_t answer)
{
    robot->register_address = address;
    robot->register_answer = answer;
    robot->base->register_begin(robot->base->context, address, NULL);
}

void robot_register_write(robot_t *robot, uint8_t address, uint16_t value, robot_register_t answer)
{
    robot->register_address = address;
    robot->register_wanted = value;
    robot->register_answer = answer;
    robot->base->register_begin(robot->base->context, address, &value);
}

static int step_register(robot_t *robot)
{
    robot_register_t answer = robot->register_answer;
    turret_register_t state;
    uint16_t value;

    if (answer == NULL)
        return 0;
    state = robot->base->register_state(robot->base->context, &value);
    if (state == TURRET_REGISTER_BUSY)
        return 0; /* the interrupt at its end wakes us */
    robot->register_answer = NULL;
    answer(robot, state == TURRET_REGISTER_READ ? &value : NULL);
    if (robot->list == NULL)
        line_editor_prompt(&robot->editor);
    return 1;
}

static void print_live_log(robot_t *robot)
{
    log_t *log = &robot->log;

    if (!robot->log_live && !robot->editor.interactive) {
        log->shown = log->written;
        return;
    }
    while (log->shown != log->written && has_room(robot, BACKGROUND_ROOM)) {
        const log_line_t *line = log_line(log, log->shown++);

        if (line == NULL)
            continue;
        if (robot->editor.interactive)
            robot_print(robot, "\r");
        robot_print(robot, "[%u.%03u %s %s] %s\r\n", line->time_ms / 1000u, line->time_ms % 1000u,
                    log_module_name((log_module_t)line->module),
                    log_level_name((log_level_t)line->level), line->text);
        line_editor_prompt(&robot->editor);
    }
}

SELDOM static void send_telemetry(robot_t *robot)
{
    telemetry_t *telemetry = &robot->telemetry;
    unsigned i;

    if (--telemetry->wait_ticks > 0)
        return;
    telemetry->wait_ticks = telemetry->period_ticks;
    if (!has_room(robot, BACKGROUND_ROOM + telemetry_line_size(telemetry))) {
        telemetry->dropped++;
        return;
    }
    robot_print(robot, "~%u", robot->ticks * MS_PER_TICK);
    for (i = 0; i < telemetry->count; i++)
        robot_print(robot, ",%d", telemetry_value(robot, telemetry->variable[i]));
    robot_print(robot, "\r\n");
}

static void restart_when_sent(robot_t *robot)
{
    const base_t *base = robot->base;

    if (robot->restart != 0 && base->console_sent(base->context))
        base->restart(base->context, (base_restart_t)(robot->restart - 1u));
}

/* ---- Play ---- */

/* Set the wheels' commands as soccer wants them now. Returns 0 if the motors must be off. */
static int steer(robot_t *robot)
{
    wheels_t wheels = {0, 0};

    if (robot->silent_ticks >= ROBOT_BLIND_SEARCH_TICKS)
        soccer_search_blind(&robot->soccer, &wheels);
    else if (robot->silent_ticks >= ROBOT_REPORT_TIMEOUT_TICKS)
        return 0;
    else if (!soccer_wheels(&robot->soccer, &wheels))
        return 0;
    motion_drive(&robot->motion, wheels.left_mm_s, wheels.right_mm_s);
    return 1;
}

/* Time since the travel of the wheels was measured, at most the fine clock's 0.66 s. */
static int32_t since_travel_100us(const robot_t *robot)
{
    uint16_t since_fine = (uint16_t)(now_fine(robot) - robot->travel_fine);

    return (int32_t)((uint32_t)since_fine * 10000u / BASE_FINE_HZ);
}

SELDOM static void use_report(robot_t *robot, const uint8_t wire[REPORT_SIZE], uint16_t age_100us)
{
    report_t report;
    uint16_t begin = now_fine(robot);
    int16_t duty[2];

    if (report_decode(wire, &report) != REPORT_OK) {
        if (robot->bad_reports < UINT16_MAX)
            robot->bad_reports++;
        log_write(&robot->log, LOG_TURRET, LOG_DEBUG, "damaged report");
        return;
    }
    if (!freshness_take(&robot->fresh, &report, age_100us)) {
        if (robot->stale_reports < UINT16_MAX)
            robot->stale_reports++;
        return;
    }
    if (robot->silent_ticks >= ROBOT_REPORT_TIMEOUT_TICKS)
        log_write(&robot->log, LOG_TURRET, LOG_INFO, "reports come");
    robot->report = report;
    robot->reports++;
    robot->silent_ticks = 0;
    heed_stop_word(robot); /* what it turned off, a report may not turn on */
    if (robot->playing) {
        soccer_see(&robot->soccer, &report, (int32_t)age_100us - since_travel_100us(robot));
        if (!steer(robot))
            motion_off(&robot->motion);
        motion_refresh(&robot->motion, duty);
        robot->base->motors(robot->base->context, duty[0], duty[1]);
    }
    tasks_ran(&robot->tasks, TASK_REPORT, begin, now_fine(robot));
}

static void take_report(robot_t *robot)
{
    uint8_t wire[REPORT_SIZE];
    uint16_t age_100us;

    if (robot->base->report(robot->base->context, wire, &age_100us))
        use_report(robot, wire, age_100us);
}

SELDOM static void tell_transitions(robot_t *robot)
{
    strategy_event_t event;

    while (soccer_take_event(&robot->soccer, &event))
        log_write(&robot->log, LOG_SOCCER, LOG_INFO, "%s -> %s: %s",
                  strategy_state_name(event.from), strategy_state_name(event.to),
                  strategy_reason_name(event.reason));
}

/* ---- Tick ---- */

static void measure_travel(robot_t *robot, int32_t moved[2])
{
    int32_t counts[2];
    unsigned i;

    robot->base->encoders(robot->base->context, counts);
    for (i = 0; i < 2; i++) {
        /* Unsigned: the counters wrap. */
        moved[i] = (int32_t)((uint32_t)counts[i] - (uint32_t)robot->counts[i]);
        robot->counts[i] = counts[i];
    }
}

static void count_silence(robot_t *robot)
{
    if (robot->silent_ticks < UINT16_MAX)
        robot->silent_ticks++;
    if (robot->silent_ticks == ROBOT_REPORT_TIMEOUT_TICKS && robot->reports > 0)
        log_write(&robot->log, LOG_TURRET, LOG_WARN, "no reports for 200 ms");
}

SELDOM static void read_sensors(robot_t *robot)
{
    uint8_t was_silent = robot->sensors.silent;

    robot->base->sensors(robot->base->context, &robot->sensors);
    if (robot->sensors.silent != was_silent)
        log_write(&robot->log, LOG_SENSORS, LOG_WARN, "A/D converter %s",
                  was_silent ? "answers again" : "does not answer");
    if (robot->sensors.silent || robot_battery_mv(robot) >= robot->parameters.battery_low_mv) {
        robot->battery_low = 0;
    } else if (robot->battery_low < BATTERY_LOW_MAX && ++robot->battery_low == BATTERY_LOW_MAX) {
        log_write(&robot->log, LOG_SENSORS, LOG_WARN, "battery low: %d mV",
                  robot_battery_mv(robot));
    }
}

static void show_leds(robot_t *robot)
{
    uint8_t leds = robot->leds;

    if (robot->playing)
        leds = (uint8_t)(LED_PLAYING | (robot->soccer.world.ball.known ? LED_BALL : 0u));
    if (leds == robot->leds_shown)
        return;
    robot->leds_shown = leds;
    robot->base->leds(robot->base->context, leds);
}

void robot_tick(robot_t *robot)
{
    uint16_t begin = now_fine(robot);
    int32_t moved[2];
    int16_t duty[2];
    int drive = 1;

    heed_stop_word(robot);
    measure_travel(robot, moved);
    robot->travel_fine = begin;
    robot->ticks++;
    freshness_tick(&robot->fresh);
    robot->log.time_ms = robot->ticks * MS_PER_TICK;
    count_silence(robot);
    if (robot->playing) {
        soccer_tick(&robot->soccer, moved);
        drive = steer(robot);
    } else if (moved[0] != 0 || moved[1] != 0) {
        base_pose_add(&robot->pose, moved);
    }
    if (!drive)
        motion_off(&robot->motion);
    motion_step(&robot->motion, moved, duty);
    if (robot->emergency)
        duty[0] = duty[1] = 0;
    robot->base->motors(robot->base->context, duty[0], duty[1]);
    if (robot->motion.new_fault)
        tell_faults(robot);
    if (soccer_has_event(&robot->soccer))
        tell_transitions(robot);
    if (robot->ticks % SENSOR_TICKS == 0)
        read_sensors(robot);
    show_leds(robot);
    tasks_ran(&robot->tasks, TASK_CONTROL, begin, now_fine(robot));
    if (robot->telemetry.count != 0)
        send_telemetry(robot);
}

/* Nothing is under way on the console, and nothing has come. */
static int console_rests(const robot_t *robot)
{
    return robot->list == NULL && robot->register_answer == NULL && !robot->saving &&
           robot->restart == 0 && robot->log.shown == robot->log.written &&
           !robot->base->console_waits(robot->base->context);
}

SELDOM static int serve_console(robot_t *robot)
{
    uint16_t begin = now_fine(robot);
    int more;

    heed_stop_word(robot);
    more = go_on_with_list(robot) || poll_console(robot);

    more |= step_save(robot);
    more |= step_register(robot);
    print_live_log(robot);
    restart_when_sent(robot);
    tasks_ran(&robot->tasks, TASK_CONSOLE, begin, now_fine(robot));
    return more;
}

int robot_poll(robot_t *robot)
{
    take_report(robot);
    return console_rests(robot) ? 0 : serve_console(robot);
}

/* ---- What others ask ---- */

robot_pose_t robot_pose(const robot_t *robot)
{
    robot_pose_t result;
    pose_t pose;
    int32_t heading;

    if (robot->playing) {
        odometry_pose(&robot->soccer.world.odometry, &pose);
        result.x_mm = pose.x_q4 / 16;
        result.y_mm = pose.y_q4 / 16;
        heading = pose.heading;
    } else {
        result.x_mm = robot->pose.x_q8 / 256;
        result.y_mm = robot->pose.y_q8 / 256;
        heading = base_pose_heading(&robot->pose);
    }
    result.heading_deg10 = heading * 3600 / 65536;
    return result;
}

int32_t robot_battery_mv(const robot_t *robot)
{
    return robot->sensors.input[BOARD_ADC_BATTERY] * BOARD_ADC_BATTERY_FULL_SCALE_MV /
           (int32_t)ADC_FULL_SCALE;
}

static void load_parameters(robot_t *robot)
{
    int32_t taken;

    parameters_default(&robot->parameters);
    if (robot->base->flash == NULL)
        return;
    parameter_store_init(&robot->store, robot->base->flash);
    taken = parameter_store_load(&robot->store, &robot->parameters);
    if (taken >= 0)
        log_write(&robot->log, LOG_SYSTEM, LOG_INFO, "%d saved parameters", taken);
    if (robot->parameters.serial_baud != (int32_t)BOARD_BAUD)
        robot->base->console_baud(robot->base->context, (uint32_t)robot->parameters.serial_baud);
}

void robot_init(robot_t *robot, const base_t *base)
{
    static const adc_readings_t no_readings = {{0}, {0}, 0};
    static const report_t no_report = {0};

    robot->base = base;
    robot->terminal.context = robot;
    robot->terminal.write = put_character;
    robot->terminal.candidate = shell_candidate;
    line_editor_init(&robot->editor, &robot->terminal);
    log_init(&robot->log);
    load_parameters(robot);
    motion_init(&robot->motion, &robot->parameters.motion);
    base_pose_reset(&robot->pose);
    soccer_init(&robot->soccer, &robot->parameters.soccer);
    soccer_start(&robot->soccer, 0);
    tasks_init(&robot->tasks, now_fine(robot));
    robot->telemetry.count = 0;
    robot->telemetry.dropped = 0;
    robot->sensors = no_readings;
    robot->report = no_report;
    base->encoders(base->context, robot->counts);
    robot->ticks = robot->reports = 0;
    robot->bad_reports = robot->stale_reports = 0;
    freshness_init(&robot->fresh);
    robot->silent_ticks = ROBOT_BLIND_SEARCH_TICKS;
    robot->playing = robot->emergency = robot->leds = robot->log_live = 0;
    robot->leds_shown = UINT8_MAX; /* none of theirs */
    robot->list = NULL;
    robot->register_answer = NULL;
    robot->saving = robot->restart = robot->battery_low = 0;
    robot_stop(robot);
    log_write(&robot->log, LOG_SYSTEM, LOG_INFO, "reset by %s", base->reset_cause);
    if (base->crash(base->context) != NULL)
        log_write(&robot->log, LOG_SYSTEM, LOG_ERROR, "crashed before; crash show tells");
    robot_print(robot, "StereoSot base, ready; help lists the commands, Tab for a shell\r\n");
}
