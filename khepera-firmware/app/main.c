/* The program on the real base: the drivers behind the seam, and the main loop. */
#include <stddef.h>

#include "app/base.h"
#include "app/robot.h"
#include "app/text.h"
#include "board/crash.h"
#include "board/khepera.h"
#include "drivers/encoders.h"
#include "drivers/interrupts.h"
#include "drivers/leds.h"
#include "drivers/motors.h"
#include "drivers/sci.h"
#include "drivers/tick.h"
#include "drivers/turret.h"

static void base_encoders(void *context, int32_t counts[2])
{
    (void)context;
    encoders_read(counts);
}

static void base_motors(void *context, int16_t left, int16_t right)
{
    (void)context;
    motors_drive(left, right);
}

static int base_report(void *context, uint8_t wire[REPORT_SIZE], uint16_t *age_100us)
{
    uint16_t age_fine = 0;

    (void)context;
    if (!turret_take(wire, &age_fine))
        return 0;
    *age_100us = (uint16_t)((uint32_t)age_fine * 10000u / TICK_FINE_HZ);
    return 1;
}

static int base_console_read(void *context)
{
    (void)context;
    return sci_read();
}

static int base_console_write(void *context, uint8_t character)
{
    (void)context;
    return sci_write(character);
}

static void base_leds(void *context, uint8_t leds)
{
    (void)context;
    leds_show(leds);
}

static int base_crash(void *context, char *buffer, uint16_t size)
{
    const crash_record_t *record = crash_last();
    text_t text;

    (void)context;
    text_begin(&text, buffer, size);
    if (record == NULL)
        return 0;
    text_add(&text, "vector ");
    text_add_decimal(&text, crash_vector(record));
    text_add(&text, " at PC ");
    text_add_hex(&text, crash_pc(record), 8);
    text_add(&text, " in build ");
    text_add_hex(&text,
                 (uint32_t)record->build_id[0] << 24 | (uint32_t)record->build_id[1] << 16 |
                     (uint32_t)record->build_id[2] << 8 | record->build_id[3],
                 8);
    return 1;
}

static uint32_t base_stack_used(void *context)
{
    (void)context;
    return stack_high_water();
}

static uint16_t base_console_lost(void *context)
{
    (void)context;
    return sci_losses();
}

static uint16_t base_reports_lost(void *context)
{
    uint32_t lost = (uint32_t)turret_overruns() + turret_timeouts();

    (void)context;
    return (uint16_t)(lost > UINT16_MAX ? UINT16_MAX : lost);
}

static robot_t robot;

/* For debuggers, and for the twin: found by its name. */
extern const soccer_belief_t *const soccer_belief;
const soccer_belief_t *const soccer_belief = &robot.soccer.belief;

/* Sleep until there is something to do. Encoder edges come by thousands a second and are none. */
static void wait_for_work(void)
{
    (void)interrupts_mask();
    while (!interrupts_work) {
        interrupts_wait();
        (void)interrupts_mask();
    }
    interrupts_work = 0;
    interrupts_enable();
}

int main(void);
int main(void)
{
    static base_t base = {
        NULL,
        base_encoders,
        base_motors,
        base_report,
        base_console_read,
        base_console_write,
        base_leds,
        NULL,
        base_crash,
        base_stack_used,
        base_console_lost,
        base_reports_lost,
    };

    base.reset_cause = reset_cause();
    motors_init();
    tick_init();
    encoders_init();
    turret_init();
    sci_init(BOARD_BAUD);
    robot_init(&robot, &base);
    interrupts_enable();

    for (;;) {
        uint8_t ticks = tick_take();

        if (ticks > 0) {
            turret_poll();
            robot_tick(&robot);
        }
        robot_poll(&robot);
        /* Both tasks ran: only now may the watchdog start anew. */
        if (ticks > 0)
            watchdog_service();

        wait_for_work();
    }
}
