/* The program on the real base: the drivers behind the seam, and the main loop. */
#include <stddef.h>

#include "app/base.h"
#include "app/robot.h"
#include "board/access.h"
#include "board/boot.h"
#include "board/crash.h"
#include "board/khepera.h"
#include "drivers/adc.h"
#include "drivers/encoders.h"
#include "drivers/extension_bus.h"
#include "drivers/flash.h"
#include "drivers/interrupts.h"
#include "drivers/leds.h"
#include "drivers/motors.h"
#include "drivers/qspi.h"
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
    encoders_driven(left, right);
}

static int base_stop_word(void *context)
{
    (void)context;
    return sci_take_stop_word();
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

static void base_register_begin(void *context, uint8_t address, const uint16_t *value)
{
    (void)context;
    turret_register_begin(address, value);
}

static turret_register_t base_register_state(void *context, uint16_t *value)
{
    (void)context;
    return turret_register_state(value);
}

static void base_sensors(void *context, adc_readings_t *readings)
{
    (void)context;
    adc_read(readings);
}

static uint8_t base_bus_read(void *context, uint8_t address)
{
    (void)context;
    return extension_bus_read(address);
}

static void base_bus_write(void *context, uint8_t address, uint8_t value)
{
    (void)context;
    extension_bus_write(address, value);
}

static void base_leds(void *context, uint8_t leds)
{
    (void)context;
    leds_show(leds);
}

static int base_console_waits(void *context)
{
    (void)context;
    return sci_waits();
}

static int base_console_read(void *context)
{
    (void)context;
    return sci_read();
}

static void base_console_write(void *context, const char *characters, uint16_t count)
{
    (void)context;
    sci_write(characters, count);
}

static uint32_t base_console_room(void *context)
{
    (void)context;
    return sci_room();
}

static int base_console_sent(void *context)
{
    (void)context;
    return sci_sent();
}

static void base_console_baud(void *context, uint32_t baud)
{
    (void)context;
    sci_set_baud(baud);
}

static uint16_t base_fine(void *context)
{
    (void)context;
    return tick_fine();
}

static void base_restart(void *context, base_restart_t how)
{
    (void)context;
    if (how == BASE_LOADER)
        boot_enter_loader();
    else
        boot_restart();
}

static const crash_record_t *base_crash(void *context)
{
    (void)context;
    return crash_last();
}

static void base_crash_clear(void *context)
{
    (void)context;
    crash_clear();
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

/* ---- The flash's parameter sectors: the program runs from RAM and may erase it ---- */

static uint16_t store_flash_read(void *context, uint32_t address)
{
    (void)context;
    return flash_board_bus.read(flash_board_bus.context, address);
}

static int store_flash_program(void *context, uint32_t address, uint16_t word)
{
    (void)context;
    return flash_program(&flash_board_bus, address, word) == FLASH_OK;
}

static int store_flash_erase_begin(void *context, uint32_t sector)
{
    (void)context;
    flash_erase_begin(&flash_board_bus, sector);
    return 1;
}

static int store_flash_erase_poll(void *context, uint32_t sector)
{
    flash_error_t state = flash_erase_poll(&flash_board_bus, sector);

    (void)context;
    if (state == FLASH_BUSY)
        return 0;
    return state == FLASH_OK ? 1 : -1;
}

static const store_flash_t store_flash = {
    .sector = {BOARD_PARAMETER_A, BOARD_PARAMETER_B},
    .size = BOARD_PARAMETER_SIZE,
    .read = store_flash_read,
    .program = store_flash_program,
    .erase_begin = store_flash_erase_begin,
    .erase_poll = store_flash_erase_poll,
};

static base_t base = {
    .encoders = base_encoders,
    .motors = base_motors,
    .stop_word = base_stop_word,
    .report = base_report,
    .register_begin = base_register_begin,
    .register_state = base_register_state,
    .sensors = base_sensors,
    .bus_read = base_bus_read,
    .bus_write = base_bus_write,
    .leds = base_leds,
    .console_waits = base_console_waits,
    .console_read = base_console_read,
    .console_write = base_console_write,
    .console_room = base_console_room,
    .console_sent = base_console_sent,
    .console_baud = base_console_baud,
    .fine = base_fine,
    .restart = base_restart,
    .crash = base_crash,
    .crash_clear = base_crash_clear,
    .stack_used = base_stack_used,
    .console_lost = base_console_lost,
    .reports_lost = base_reports_lost,
};
static robot_t robot;

/* For the twin, which finds it by its name: what soccer believes (soccer/belief.h). */
extern const soccer_belief_t *const soccer_belief;
const soccer_belief_t *const soccer_belief = &robot.soccer.belief;

static void poll_drivers(void)
{
    qspi_owner_t owner;
    int gave_up = qspi_poll(&owner);

    turret_poll(gave_up && owner == QSPI_TURRET);
    if (gave_up && owner == QSPI_REGISTER)
        turret_register_give_up();
    adc_tick();
    sci_poll();
}

/* Sleep until there is something to do. Encoder edges come by thousands a second and are none. */
static void wait_for_work(void)
{
    uint16_t begin = tick_fine();

    access_sleep_until(&interrupts_work);
    interrupts_work = 0;
    access_unmask();
    tasks_slept(&robot.tasks, begin, tick_fine());
}

static void init_base(void)
{
    base.reset_cause = boot_was_asked() ? "restart" : reset_cause();
    base.build_id = build_id();
    base.stack_size = stack_capacity();
    base.flash = &store_flash;
    motors_init();
    tick_init();
    encoders_init();
    qspi_init();
    leds_init();
    adc_init();
    turret_init();
    extension_bus_init();
    sci_init(BOARD_BAUD);
}

int main(void);
int main(void)
{
    init_base();
    robot_init(&robot, &base);
    access_unmask();

    for (;;) {
        uint8_t ticks = tick_take();
        int more;

        if (ticks > 0) {
            robot.tasks.late_ticks += ticks - 1u;
            poll_drivers();
            robot_tick(&robot);
        }
        more = robot_poll(&robot);
        /* Both tasks ran: only now may the watchdog start anew. */
        if (ticks > 0)
            watchdog_service();
        if (!more)
            wait_for_work();
    }
}
