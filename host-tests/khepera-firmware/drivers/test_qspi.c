// sources: khepera-firmware/drivers/qspi.c khepera-firmware/drivers/turret.c
// sources: khepera-firmware/drivers/adc.c khepera-firmware/drivers/tick.c
// sources: host-tests/khepera-firmware/fakes/chip.c
// includes: host-tests/khepera-firmware/fakes khepera-firmware
/* The shared QSPI, and its two owners: the vision turret and the A/D converter. */
#include "drivers/qspi.h"

#include <string.h>
#include <unity.h>

#include "board/khepera.h"
#include "board/mc68331.h"
#include "drivers/adc.h"
#include "drivers/interrupts.h"
#include "drivers/turret.h"
#include "link/registers.h"

#define ATTENTION (1u << BOARD_TURRET_ATTENTION_IRQ)
#define EMITTERS  (1u << BOARD_PF_EMITTERS)
#define FINE      64 /* counts of PWMCNT in one of tick_fine() */

void qspi_isr(void);
void turret_attention_isr(void);

static uint8_t wire[TURRET_REPORT_BYTES];
static uint16_t age;

void setUp(void)
{
    memset(fake_registers, 0, sizeof fake_registers);
    PORTF = ATTENTION;
    qspi_init();
    turret_init();
    (void)turret_take(wire, &age);
    adc_init();
    interrupts_work = 0;
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(0, fake_masked, "interrupts left masked");
}

static int is_running(void)
{
    return (SPCR1 & SPCR1_SPE) != 0;
}

static unsigned words_of_run(void)
{
    return (SPCR2 >> 8 & 15u) + 1u;
}

/* The chip has clocked the queue: word i brought first + i * step. */
static void end_run(uint16_t first, uint16_t step)
{
    unsigned i;

    TEST_ASSERT_TRUE(is_running());
    for (i = 0; i < words_of_run(); i++)
        QSPI_RX(i) = (uint16_t)(first + i * step);
    SPCR1 = 0;
    qspi_isr();
}

/* Ticks until the converter's readings begin. */
static void wait_for_readings(void)
{
    int ticks = 0;

    while (!is_running()) {
        adc_tick();
        TEST_ASSERT_LESS_THAN_INT(3, ++ticks);
    }
}

static void attention_fetches_a_report_of_16_words_with_one_select(void)
{
    unsigned i;

    PWMCNT = 100 * FINE;
    turret_attention_isr();
    TEST_ASSERT_TRUE(is_running());
    TEST_ASSERT_EQUAL_UINT(16, words_of_run());
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0, PFPAR, "no second interrupt during the run");
    for (i = 0; i < 16; i++) {
        TEST_ASSERT_EQUAL_HEX8((i < 15 ? QSPI_CMD_CONT : 0) | QSPI_CMD_BITS | BOARD_PCS_TURRET,
                               QSPI_CMD(i));
        TEST_ASSERT_EQUAL_HEX16(0, QSPI_TX(i));
    }
    end_run(0x0102, 0x0202);
    TEST_ASSERT_EQUAL_HEX8(ATTENTION, PFPAR);
    TEST_ASSERT_EQUAL_UINT8(1, interrupts_work);
    PWMCNT = 130 * FINE;
    TEST_ASSERT_EQUAL(1, turret_take(wire, &age));
    for (i = 0; i < TURRET_REPORT_BYTES; i++)
        TEST_ASSERT_EQUAL_UINT8(i + 1, wire[i]);
    TEST_ASSERT_EQUAL_UINT16(30, age);
    TEST_ASSERT_EQUAL(0, turret_take(wire, &age));
}

static void the_newest_report_wins_and_the_lost_one_counts(void)
{
    uint16_t before = turret_overruns();

    turret_attention_isr();
    end_run(0x1111, 0);
    turret_attention_isr();
    end_run(0x2222, 0);
    TEST_ASSERT_EQUAL(1, turret_take(wire, &age));
    TEST_ASSERT_EQUAL_HEX8(0x22, wire[0]);
    TEST_ASSERT_EQUAL_UINT16(before + 1, turret_overruns());
}

static void a_line_that_stays_low_is_looked_at_once_a_tick(void)
{
    PORTF = 0;
    turret_attention_isr();
    end_run(0, 0);
    TEST_ASSERT_EQUAL_HEX8(0, PFPAR);
    turret_poll(0);
    TEST_ASSERT_EQUAL_HEX8(ATTENTION, PFPAR);
}

static void a_run_that_does_not_end_is_given_up(void)
{
    qspi_owner_t owner = QSPI_ADC;
    uint16_t before = turret_timeouts();

    turret_attention_isr();
    TEST_ASSERT_EQUAL(0, qspi_poll(&owner));
    TEST_ASSERT_EQUAL(1, qspi_poll(&owner));
    TEST_ASSERT_EQUAL(QSPI_TURRET, owner);
    TEST_ASSERT_FALSE(is_running());
    turret_poll(1);
    TEST_ASSERT_EQUAL_UINT16(before + 1, turret_timeouts());
    TEST_ASSERT_EQUAL_HEX8(ATTENTION, PFPAR);
    turret_attention_isr();
    TEST_ASSERT_TRUE(is_running());
    end_run(0, 0);
}

/* The words of a register's run, which must be the present one. */
static void check_run(const uint8_t *bytes, unsigned words)
{
    unsigned i;

    TEST_ASSERT_TRUE(is_running());
    TEST_ASSERT_EQUAL_UINT(REGISTER_READ_BYTES / 2, words_of_run());
    TEST_ASSERT_EQUAL_HEX8(QSPI_CMD_CONT | QSPI_CMD_BITS | BOARD_PCS_TURRET, QSPI_CMD(0));
    TEST_ASSERT_EQUAL_HEX8(QSPI_CMD_BITS | BOARD_PCS_TURRET, QSPI_CMD(2));
    for (i = 0; i < words; i++)
        TEST_ASSERT_EQUAL_HEX16(bytes[2 * i] << 8 | bytes[2 * i + 1], QSPI_TX(i));
}

static void answer_read(const uint8_t *bytes)
{
    unsigned i;

    for (i = 1; i < REGISTER_READ_BYTES / 2; i++)
        QSPI_RX(i) = (uint16_t)(bytes[2 * i] << 8 | bytes[2 * i + 1]);
    SPCR1 = 0;
    qspi_isr();
}

static const uint8_t golden_write[] = {0x80, 0x04, 0x00, 0x3D, 0x62, 0xC6};
static const uint8_t golden_read[] = {0x40, 0x04, 0x00, 0x3C, 0xC1, 0x43};

static void a_register_is_read_in_a_run_of_its_own(void)
{
    uint16_t value = 1;

    turret_register_begin(FPGA_REG_GOAL_ROW, NULL);
    check_run(golden_read, 1);
    TEST_ASSERT_EQUAL(TURRET_REGISTER_BUSY, turret_register_state(&value));
    interrupts_work = 0;
    answer_read(golden_read);
    TEST_ASSERT_EQUAL(TURRET_REGISTER_READ, turret_register_state(&value));
    TEST_ASSERT_EQUAL_UINT16(60, value);
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(1, interrupts_work, "the program must wake");
    TEST_ASSERT_FALSE(is_running());
    TEST_ASSERT_EQUAL(0, turret_take(wire, &age));
}

static void a_register_write_is_read_back(void)
{
    const uint16_t wanted = 61;
    uint16_t value = 1;

    turret_register_begin(FPGA_REG_GOAL_ROW, &wanted);
    check_run(golden_write, 3);
    SPCR1 = 0;
    qspi_isr();
    check_run(golden_read, 1);
    TEST_ASSERT_EQUAL(TURRET_REGISTER_BUSY, turret_register_state(&value));
    answer_read(golden_read);
    TEST_ASSERT_EQUAL(TURRET_REGISTER_READ, turret_register_state(&value));
    TEST_ASSERT_EQUAL_UINT16_MESSAGE(60, value, "what it is, not what was wanted");
}

static void an_answer_damaged_in_any_bit_is_none_and_neither_is_nobodys(void)
{
    uint8_t damaged[REGISTER_READ_BYTES];
    uint16_t value = 1;
    unsigned bit;
    unsigned address;

    for (bit = 16; bit < 8 * REGISTER_READ_BYTES; bit++) {
        memcpy(damaged, golden_read, sizeof damaged);
        damaged[bit / 8] ^= (uint8_t)(1u << bit % 8);
        turret_register_begin(FPGA_REG_GOAL_ROW, NULL);
        answer_read(damaged);
        TEST_ASSERT_EQUAL(TURRET_REGISTER_FAILED, turret_register_state(&value));
    }
    for (address = 0; address < FPGA_REG_COUNT; address++) {
        turret_register_begin((uint8_t)address, NULL);
        end_run(0xFFFF, 0);
        TEST_ASSERT_EQUAL(TURRET_REGISTER_FAILED, turret_register_state(&value));
        turret_register_begin((uint8_t)address, NULL);
        end_run(0, 0);
        TEST_ASSERT_EQUAL(TURRET_REGISTER_FAILED, turret_register_state(&value));
    }
    TEST_ASSERT_EQUAL_UINT16(1, value);
}

static void a_register_waits_for_a_report_and_the_other_way_round(void)
{
    uint16_t value;

    turret_attention_isr();
    turret_register_begin(FPGA_REG_GOAL_ROW, NULL);
    TEST_ASSERT_EQUAL_UINT(16, words_of_run());
    end_run(0x1111, 0);
    check_run(golden_read, 1);
    turret_attention_isr();
    answer_read(golden_read);
    TEST_ASSERT_EQUAL(TURRET_REGISTER_READ, turret_register_state(&value));
    TEST_ASSERT_EQUAL_UINT(16, words_of_run());
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(0, QSPI_TX(0), "a report's run writes nothing");
    end_run(0x2222, 0);
    TEST_ASSERT_EQUAL(1, turret_take(wire, &age));
    TEST_ASSERT_EQUAL_HEX8(0x22, wire[0]);
}

static void a_registers_run_that_does_not_end_is_a_failure(void)
{
    qspi_owner_t owner = QSPI_ADC;
    uint16_t value;

    turret_register_begin(FPGA_REG_GOAL_ROW, NULL);
    (void)qspi_poll(&owner);
    TEST_ASSERT_EQUAL(1, qspi_poll(&owner));
    TEST_ASSERT_EQUAL(QSPI_REGISTER, owner);
    turret_register_give_up();
    TEST_ASSERT_EQUAL(TURRET_REGISTER_FAILED, turret_register_state(&value));
    turret_register_begin(FPGA_REG_GOAL_ROW, NULL);
    answer_read(golden_read);
    TEST_ASSERT_EQUAL(TURRET_REGISTER_READ, turret_register_state(&value));
}

static void both_owners_get_their_runs_one_after_the_other(void)
{
    wait_for_readings();
    TEST_ASSERT_EQUAL_UINT(ADC_INPUTS + 1, words_of_run());
    turret_attention_isr();
    TEST_ASSERT_EQUAL_UINT_MESSAGE(ADC_INPUTS + 1, words_of_run(), "the run under way goes on");
    end_run(0x0040, 0x0040);
    TEST_ASSERT_EQUAL_UINT(16, words_of_run());
    TEST_ASSERT_EQUAL_HEX8(QSPI_CMD_BITS | BOARD_PCS_TURRET, QSPI_CMD(15));
    end_run(0, 0);
    TEST_ASSERT_FALSE(is_running());
    wait_for_readings();
    TEST_ASSERT_EQUAL_HEX8(QSPI_CMD_BITS | QSPI_CMD_DT | BOARD_PCS_ADC, QSPI_CMD(0));
    end_run(0, 0);
}

static void the_delay_is_longer_than_a_conversion(void)
{
    wait_for_readings();
    TEST_ASSERT_GREATER_THAN_UINT32(21u * (BOARD_SYSTEM_HZ / 1000000u), (SPCR1 & 0xFFu) * 32u);
    end_run(0, 0);
}

static void ten_ticks_bring_proximity_five_times_and_ambient_light_once(void)
{
    adc_readings_t readings;
    unsigned runs_on = 0;
    unsigned runs_off = 0;
    unsigned tick;
    unsigned i;

    for (tick = 0; tick < 10; tick++) {
        adc_tick();
        if (!is_running())
            continue;
        for (i = 0; i < ADC_INPUTS; i++)
            TEST_ASSERT_EQUAL_HEX16(i << 12, QSPI_TX(i));
        if (PORTF & EMITTERS) {
            runs_on++;
            end_run(0, 64); /* input i reads i + 1 */
        } else {
            runs_off++;
            end_run(64 * 99, 64); /* input i reads i + 100 */
        }
    }
    TEST_ASSERT_EQUAL_UINT(5, runs_on);
    TEST_ASSERT_EQUAL_UINT(1, runs_off);
    adc_read(&readings);
    for (i = 0; i < ADC_SENSORS; i++) {
        TEST_ASSERT_EQUAL_UINT16(i + 1, readings.input[i]);
        TEST_ASSERT_EQUAL_UINT16(i + 100, readings.ambient[i]);
    }
    TEST_ASSERT_EQUAL_UINT16(8 + 100, readings.input[BOARD_ADC_BATTERY]);
    TEST_ASSERT_EQUAL_UINT8(0, readings.silent);
}

static void ticks_without_an_answer(unsigned ticks)
{
    for (; ticks > 0; ticks--) {
        adc_tick();
        if (is_running())
            end_run(0xFFFF, 0);
    }
}

static void a_converter_that_leaves_the_line_high_is_silent_after_100_ms(void)
{
    adc_readings_t readings;

    wait_for_readings();
    end_run(0x1000, 0);
    ticks_without_an_answer(9);
    adc_read(&readings);
    TEST_ASSERT_EQUAL_UINT8(0, readings.silent);
    ticks_without_an_answer(1);
    adc_read(&readings);
    TEST_ASSERT_EQUAL_UINT8(1, readings.silent);
    TEST_ASSERT_EQUAL_UINT16_MESSAGE(0x40, readings.input[0], "the last good one stays");
    wait_for_readings();
    end_run(0x2000, 0);
    adc_read(&readings);
    TEST_ASSERT_EQUAL_UINT8(0, readings.silent);
}

static void an_interrupt_without_a_run_is_ignored(void)
{
    SPSR = SPSR_SPIF;
    qspi_isr();
    TEST_ASSERT_EQUAL_HEX8(0, SPSR);
    TEST_ASSERT_EQUAL(0, turret_take(wire, &age));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(attention_fetches_a_report_of_16_words_with_one_select);
    RUN_TEST(the_newest_report_wins_and_the_lost_one_counts);
    RUN_TEST(a_line_that_stays_low_is_looked_at_once_a_tick);
    RUN_TEST(a_run_that_does_not_end_is_given_up);
    RUN_TEST(a_register_is_read_in_a_run_of_its_own);
    RUN_TEST(a_register_write_is_read_back);
    RUN_TEST(an_answer_damaged_in_any_bit_is_none_and_neither_is_nobodys);
    RUN_TEST(a_register_waits_for_a_report_and_the_other_way_round);
    RUN_TEST(a_registers_run_that_does_not_end_is_a_failure);
    RUN_TEST(both_owners_get_their_runs_one_after_the_other);
    RUN_TEST(the_delay_is_longer_than_a_conversion);
    RUN_TEST(ten_ticks_bring_proximity_five_times_and_ambient_light_once);
    RUN_TEST(a_converter_that_leaves_the_line_high_is_silent_after_100_ms);
    RUN_TEST(an_interrupt_without_a_run_is_ignored);
    return UNITY_END();
}
