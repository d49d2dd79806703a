// sources: khepera-firmware/drivers/motors.c khepera-firmware/drivers/leds.c
// sources: khepera-firmware/drivers/encoders.c khepera-firmware/drivers/tick.c
// sources: khepera-firmware/drivers/extension_bus.c host-tests/khepera-firmware/fakes/chip.c
// includes: host-tests/khepera-firmware/fakes khepera-firmware
/* The small drivers: motors, LEDs, encoders, clocks and watchdog, extension bus. */
#include <string.h>
#include <unity.h>

#include "board/khepera.h"
#include "board/mc68331.h"
#include "drivers/encoders.h"
#include "drivers/extension_bus.h"
#include "drivers/interrupts.h"
#include "drivers/leds.h"
#include "drivers/motors.h"
#include "drivers/tick.h"

void encoder_left_isr(void);
void encoder_right_isr(void);
void tick_isr(void);

void setUp(void)
{
    memset(fake_registers, 0, sizeof fake_registers);
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(0, fake_masked, "interrupts left masked");
}

static void check_drive(int16_t left, int16_t right, uint16_t duties, int forward_left,
                        int forward_right)
{
    motors_drive(left, right);
    TEST_ASSERT_EQUAL_HEX16(duties, PWMAB);
    TEST_ASSERT_EQUAL(forward_left, PORTGP >> BOARD_GP_LEFT_FORWARD & 1);
    TEST_ASSERT_EQUAL(forward_right, PORTGP >> BOARD_GP_RIGHT_FORWARD & 1);
}

static void motors_get_duty_and_direction(void)
{
    motors_init();
    TEST_ASSERT_EQUAL_HEX16(0, PWMAB);
    TEST_ASSERT_EQUAL_HEX8(1u << BOARD_GP_LEFT_FORWARD | 1u << BOARD_GP_RIGHT_FORWARD, DDRGP);
    check_drive(0, 0, 0x0000, 1, 1);
    check_drive(1, -2, 0x0102, 1, 0);
    check_drive(-255, 255, 0xFFFF, 0, 1);
    check_drive(3000, -3000, 0xFFFF, 1, 0);
    check_drive(INT16_MIN, INT16_MAX, 0xFFFF, 0, 1);
}

static void leds_leave_the_emitters_alone(void)
{
    leds_init();
    TEST_ASSERT_EQUAL_HEX8(0x07, DDRF);
    PORTF = 1u << BOARD_PF_EMITTERS;
    leds_show(3);
    TEST_ASSERT_EQUAL_HEX8(0x07, PORTF);
    leds_show(2);
    TEST_ASSERT_EQUAL_HEX8(0x06, PORTF);
    leds_show(0);
    TEST_ASSERT_EQUAL_HEX8(0x04, PORTF);
}

/* One edge of A, with B as it is then. */
static void edge(void (*isr)(void), unsigned a, unsigned b)
{
    TFLG1 = 0xFF;
    PORTGP = (uint8_t)((a << BOARD_GP_LEFT_A) | (b << BOARD_GP_LEFT_B) | (a << BOARD_GP_RIGHT_A) |
                       (b << BOARD_GP_RIGHT_B));
    isr();
}

static void encoders_count_both_ways(void)
{
    int32_t before[2];
    int32_t counts[2];

    encoders_init();
    encoders_read(before);
    edge(encoder_left_isr, 1, 0);
    TEST_ASSERT_EQUAL_HEX8_MESSAGE((uint8_t)~TFLG1_IC1, TFLG1, "its own flag only");
    edge(encoder_left_isr, 0, 1);
    edge(encoder_left_isr, 1, 0);
    edge(encoder_right_isr, 1, 1);
    TEST_ASSERT_EQUAL_HEX8((uint8_t)~TFLG1_IC2, TFLG1);
    edge(encoder_right_isr, 0, 0);
    encoders_read(counts);
    TEST_ASSERT_EQUAL_INT32(before[0] + 3, counts[0]);
    TEST_ASSERT_EQUAL_INT32(before[1] - 2, counts[1]);
}

/* A look at the left wheel after `edges` of A, forward; how far it went since the last one. */
static int32_t period_by_edges(unsigned edges)
{
    static int32_t last;
    int32_t counts[2];
    int32_t moved;
    unsigned i;

    for (i = 0; i < edges; i++)
        edge(encoder_left_isr, i % 2 == 0, i % 2 != 0);
    TFLG1 = 0;
    encoders_read(counts);
    moved = counts[0] - last;
    last = counts[0];
    return moved;
}

static int32_t period_by_pulses(unsigned pulses, unsigned high)
{
    PACNT = (uint8_t)(PACNT + pulses);
    PORTGP = (uint8_t)(high << BOARD_GP_LEFT_A);
    return period_by_edges(0);
}

static int left_interrupts(void)
{
    return (TMSK1 & TFLG1_IC1) != 0;
}

/* Brisk, driven forward for two periods: counted by pulses from then on. */
static void become_brisk(void)
{
    encoders_init();
    encoders_driven(100, 0);
    PACNT = 250;
    (void)period_by_edges(0);
    (void)period_by_edges(20);
    TEST_ASSERT_TRUE(left_interrupts());
    TEST_ASSERT_EQUAL_INT32(20, period_by_edges(20));
    TEST_ASSERT_FALSE(left_interrupts());
}

static void a_brisk_wheel_is_counted_by_pulses_until_it_is_slow(void)
{
    become_brisk();
    TEST_ASSERT_EQUAL_INT32_MESSAGE(19, period_by_pulses(10, 1), "one falling edge to come");
    TEST_ASSERT_EQUAL_INT32_MESSAGE(21, period_by_pulses(10, 0), "... came");
    TEST_ASSERT_EQUAL_INT32(120, period_by_pulses(60, 0));
    TEST_ASSERT_FALSE(left_interrupts());
    TEST_ASSERT_EQUAL_INT32_MESSAGE(1, period_by_pulses(1, 1), "slow: counted, then by edges");
    TEST_ASSERT_TRUE(left_interrupts());
    TEST_ASSERT_EQUAL_INT32(3, period_by_edges(3));
}

static void a_wheel_driven_back_is_counted_by_edges_at_once_unless_it_rushes(void)
{
    become_brisk();
    (void)period_by_pulses(35, 0);
    encoders_driven(-255, 0);
    TEST_ASSERT_FALSE_MESSAGE(left_interrupts(), "70 counts a period: it cannot turn back in one");
    TEST_ASSERT_EQUAL_INT32(50, period_by_pulses(25, 0));
    TEST_ASSERT_TRUE(left_interrupts());

    become_brisk();
    PACNT = (uint8_t)(PACNT + 4);
    encoders_driven(-1, 0);
    TEST_ASSERT_TRUE(left_interrupts());
    TEST_ASSERT_EQUAL_INT32_MESSAGE(8 + 2, period_by_edges(2), "nothing is lost or counted twice");
}

static void a_wheel_that_coasts_or_is_driven_back_is_never_begun_to_be_counted_by_pulses(void)
{
    int16_t duty;

    for (duty = -1; duty <= 0; duty++) {
        unsigned i;

        encoders_init();
        encoders_driven(duty, 0);
        for (i = 0; i < 5; i++) {
            (void)period_by_edges(40);
            TEST_ASSERT_TRUE(left_interrupts());
        }
    }
}

static void without_its_clock_the_right_wheel_is_counted_by_edges(void)
{
    int32_t counts[2];
    unsigned period;
    unsigned i;

    encoders_init();
    TMSK2 = 6; /* what a loader may have left: it cannot be changed any more */
    encoders_driven(0, 100);
    for (period = 0; period < 4; period++) {
        for (i = 0; i < 30; i++)
            edge(encoder_right_isr, i % 2 == 0, i % 2 != 0);
        TFLG1 = 0;
        encoders_read(counts);
        TEST_ASSERT_TRUE(TMSK1 & TFLG1_IC2);
    }
}

static void the_fine_clock_goes_on_while_the_counter_behind_it_wraps(void)
{
    uint16_t before;
    unsigned i;

    PWMCNT = 65000;
    tick_init();
    before = tick_fine();
    for (i = 0; i < 20; i++) {
        PWMCNT = (uint16_t)(PWMCNT + 62976); /* a tick's */
        tick_isr();
    }
    PWMCNT = (uint16_t)(PWMCNT + 640);
    TEST_ASSERT_EQUAL_UINT16(before + 20 * 984 + 10, tick_fine());
}

static void ticks_are_counted_until_taken(void)
{
    tick_init();
    TEST_ASSERT_EQUAL_UINT16(82, PITR);
    (void)tick_take();
    interrupts_work = 0;
    tick_isr();
    tick_isr();
    TEST_ASSERT_EQUAL_UINT8(1, interrupts_work);
    TEST_ASSERT_EQUAL_UINT8(2, tick_take());
    TEST_ASSERT_EQUAL_UINT8(0, tick_take());
}

static void the_watchdog_gets_its_second_word_last(void)
{
    watchdog_service();
    TEST_ASSERT_EQUAL_HEX8(0xAA, SWSR);
}

static void every_reset_cause_has_its_name(void)
{
    static const struct {
        uint8_t bits;
        const char *name;
    } causes[] = {{0x40, "power"},        {0x80, "external"},      {0x20, "watchdog"},
                  {0x10, "halt monitor"}, {0x04, "loss of clock"}, {0x02, "reset instruction"},
                  {0x00, "unknown"}};
    unsigned i;

    for (i = 0; i < sizeof causes / sizeof causes[0]; i++) {
        RSR = causes[i].bits;
        TEST_ASSERT_EQUAL_STRING(causes[i].name, reset_cause());
    }
}

static void the_extension_bus_has_a_chip_select_and_64_bytes(void)
{
    extension_bus_init();
    TEST_ASSERT_EQUAL_HEX16(BOARD_EXTENSION_BASE >> 8, CSBAR3);
    TEST_ASSERT_EQUAL_HEX16(0x0300, CSPAR0);
    extension_bus_write(3, 0x5A);
    extension_bus_write(63, 0xA5);
    TEST_ASSERT_EQUAL_HEX8(0x5A, extension_bus_read(3));
    TEST_ASSERT_EQUAL_HEX8(0xA5, extension_bus_read(63));
    TEST_ASSERT_EQUAL_HEX8(0, extension_bus_read(4));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(motors_get_duty_and_direction);
    RUN_TEST(leds_leave_the_emitters_alone);
    RUN_TEST(encoders_count_both_ways);
    RUN_TEST(a_brisk_wheel_is_counted_by_pulses_until_it_is_slow);
    RUN_TEST(a_wheel_driven_back_is_counted_by_edges_at_once_unless_it_rushes);
    RUN_TEST(a_wheel_that_coasts_or_is_driven_back_is_never_begun_to_be_counted_by_pulses);
    RUN_TEST(without_its_clock_the_right_wheel_is_counted_by_edges);
    RUN_TEST(the_fine_clock_goes_on_while_the_counter_behind_it_wraps);
    RUN_TEST(ticks_are_counted_until_taken);
    RUN_TEST(the_watchdog_gets_its_second_word_last);
    RUN_TEST(every_reset_cause_has_its_name);
    RUN_TEST(the_extension_bus_has_a_chip_select_and_64_bytes);
    return UNITY_END();
}
