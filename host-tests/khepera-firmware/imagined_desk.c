#include "imagined_desk.h"

#include <math.h>
#include <string.h>

#include "drivers/stop_word.h"

/* Wheels: counts in 10 ms at full duty, and the share of a change that 10 ms bring. */
#define FULL_COUNTS 120.0
#define LAG         0.18

static void encoders(void *context, int32_t counts[2])
{
    memcpy(counts, ((desk_t *)context)->counts, 2 * sizeof counts[0]);
}

static void motors(void *context, int16_t left, int16_t right)
{
    desk_t *desk = context;

    desk->duty[0] = left;
    desk->duty[1] = right;
}

static int take_stop_word(void *context)
{
    desk_t *desk = context;
    int found = desk->stop_word;

    desk->stop_word = 0;
    return found;
}

static int take_report(void *context, uint8_t wire[REPORT_SIZE], uint16_t *age_100us)
{
    desk_t *desk = context;

    if (!desk->report_ready)
        return 0;
    memcpy(wire, desk->report, REPORT_SIZE);
    *age_100us = 1;
    desk->report_ready = 0;
    return 1;
}

/* The FPGA's registers: one takes only what fits a byte, and reads are over at the next poll. */
static void register_begin(void *context, uint8_t address, const uint16_t *value)
{
    desk_t *desk = context;

    desk->register_address = address;
    if (value != NULL && *value <= UINT8_MAX)
        desk->registers[address] = *value;
}

static turret_register_t register_state(void *context, uint16_t *value)
{
    desk_t *desk = context;

    if (desk->turret_gone)
        return TURRET_REGISTER_FAILED;
    *value = desk->registers[desk->register_address];
    return TURRET_REGISTER_READ;
}

static void sensors(void *context, adc_readings_t *readings)
{
    *readings = ((desk_t *)context)->sensors;
}

static uint8_t bus_read(void *context, uint8_t address)
{
    return ((desk_t *)context)->extension[address];
}

static void bus_write(void *context, uint8_t address, uint8_t value)
{
    ((desk_t *)context)->extension[address] = value;
}

static void show_leds(void *context, uint8_t leds)
{
    ((desk_t *)context)->leds = leds;
}

static int console_waits(void *context)
{
    return ((desk_t *)context)->input_left > 0;
}

static int console_read(void *context)
{
    desk_t *desk = context;

    if (desk->input_left == 0)
        return -1;
    /* As the receive interrupt does. */
    if (stop_word_take(&desk->stop_matched, *desk->input)) {
        desk->stop_word = 1;
        desk->duty[0] = desk->duty[1] = 0;
    }
    desk->input_left--;
    return *desk->input++;
}

static void console_write(void *context, const char *characters, uint16_t count)
{
    desk_t *desk = context;

    for (; count > 0; count--, characters++) {
        if (desk->printed_count + 1 < DESK_PRINTED_SIZE)
            desk->printed[desk->printed_count++] = *characters;
    }
    desk->printed[desk->printed_count] = '\0';
}

static uint32_t console_room(void *context)
{
    return ((desk_t *)context)->room;
}

static int console_sent(void *context)
{
    (void)context;
    return 1;
}

static void console_baud(void *context, uint32_t baud)
{
    ((desk_t *)context)->baud = baud;
}

static uint16_t fine(void *context)
{
    return ((desk_t *)context)->fine++;
}

static void restart(void *context, base_restart_t how)
{
    ((desk_t *)context)->restarted = 1 + (int)how;
}

static const crash_record_t *last_crash(void *context)
{
    return ((desk_t *)context)->crash;
}

static void crash_clear_(void *context)
{
    ((desk_t *)context)->crash = NULL;
}

static uint32_t stack_used(void *context)
{
    (void)context;
    return 512;
}

static uint16_t none_lost(void *context)
{
    (void)context;
    return 0;
}

static const uint8_t id[BUILD_ID_BYTES] = {0xAB, 0xCD};

static const base_t functions = {
    .encoders = encoders,
    .motors = motors,
    .stop_word = take_stop_word,
    .report = take_report,
    .register_begin = register_begin,
    .register_state = register_state,
    .sensors = sensors,
    .bus_read = bus_read,
    .bus_write = bus_write,
    .leds = show_leds,
    .console_waits = console_waits,
    .console_read = console_read,
    .console_write = console_write,
    .console_room = console_room,
    .console_sent = console_sent,
    .console_baud = console_baud,
    .fine = fine,
    .restart = restart,
    .reset_cause = "power",
    .build_id = id,
    .crash = last_crash,
    .crash_clear = crash_clear_,
    .stack_used = stack_used,
    .stack_size = 8192,
    .console_lost = none_lost,
    .reports_lost = none_lost,
};

void desk_begin(desk_t *desk)
{
    memset(desk, 0, sizeof *desk);
    desk->room = UINT32_MAX;
    desk->sensors.input[BOARD_ADC_BATTERY] = 491;
    desk->base = functions;
    desk->base.context = desk;
    robot_init(&desk->robot, &desk->base);
}

void desk_feed(desk_t *desk, const void *characters, uint32_t count)
{
    desk->input = characters;
    desk->input_left = count;
    while (robot_poll(&desk->robot) || desk->input_left > 0) {
        if (desk->robot.saving || desk->robot.restart != 0 || desk->room < ROBOT_REPLY_ROOM)
            return;
    }
}

void desk_ticks(desk_t *desk, unsigned count)
{
    unsigned i;

    for (; count > 0; count--) {
        for (i = 0; i < 2; i++) {
            desk->speed[i] += (desk->duty[i] * FULL_COUNTS / 255 - desk->speed[i]) * LAG;
            if (desk->duty[i] == 0 && fabs(desk->speed[i]) < 1)
                desk->speed[i] = 0;
            desk->travel[i] += desk->speed[i];
            desk->counts[i] = (int32_t)floor(desk->travel[i]);
        }
        robot_tick(&desk->robot);
        (void)robot_poll(&desk->robot);
    }
}

const char *desk_ask(desk_t *desk, const char *line)
{
    desk->printed_count = 0;
    desk->printed[0] = '\0';
    desk_feed(desk, line, (uint32_t)strlen(line));
    return desk->printed;
}

void desk_show(desk_t *desk, const report_t *report)
{
    report_encode(report, desk->report);
    desk->report_ready = 1;
    (void)robot_poll(&desk->robot);
}
