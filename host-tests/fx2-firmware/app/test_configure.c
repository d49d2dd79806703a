// sources: fx2-firmware/app/configure.c fx2-firmware/app/slot_store.c fx2-firmware/app/flash_chip.c
// sources: host-tests/fx2-firmware/fakes/fake_turret.c host-tests/fx2-firmware/fakes/fake_clock.c
// includes: fx2-firmware
#include "app/configure.h"
#include "board/turret.h"
#include "host-tests/fx2-firmware/fakes/fake_clock.h"
#include "host-tests/fx2-firmware/fakes/fake_turret.h"

#include <unity.h>

#define SLOT   9
#define LENGTH 234456u /* of an XCV300E */
#define SEED   0x5A

/* More steps than any run may need. */
#define STEPS_MAX 1000000l

void setUp(void)
{
    fake_turret_reset();
    fake_clock_now_us = 0;
    fake_flash_store(SLOT, 0, LENGTH, 1, SEED);
    fake_flash_record(SLOT, 0, 0, SLOT_RECORD_DEFAULT, 1);
    fake_fpga.done_byte = LENGTH;
}

void tearDown(void) {}

static const config_status_t *told(void)
{
    static config_status_t status;

    TEST_ASSERT_EQUAL(1, config_status_decode(configure_status(), &status));
    return &status;
}

static const config_status_t *run_to_end(void)
{
    long steps = 0;

    while (configure_step()) {
        TEST_ASSERT_EQUAL(CONFIG_BUSY, told()->result);
        TEST_ASSERT_TRUE_MESSAGE(++steps < STEPS_MAX, "it does not end");
    }
    return told();
}

static const config_status_t *configure(void)
{
    configure_start();
    return run_to_end();
}

static void assert_left_alone(void)
{
    TEST_ASSERT_FALSE(fake_flash.selected);
    TEST_ASSERT_FALSE(fake_fpga.selected);
    TEST_ASSERT_FALSE(fake_fpga.program_low);
}

/* The FPGA holds no part of a design: PROG# fell after the last byte. */
static void assert_fails_clean(uint8_t result)
{
    const config_status_t *status = configure();

    TEST_ASSERT_EQUAL(result, status->result);
    TEST_ASSERT_EQUAL(0, status->done);
    TEST_ASSERT_EQUAL(0, fake_fpga.taken_count);
    assert_left_alone();
}

static void test_a_good_bitstream_brings_the_fpga_up(void)
{
    const config_status_t *status = configure();

    TEST_ASSERT_EQUAL(CONFIG_OK, status->result);
    TEST_ASSERT_EQUAL(SLOT, status->slot);
    TEST_ASSERT_EQUAL(1, status->init);
    TEST_ASSERT_EQUAL(1, status->done);
    TEST_ASSERT_EQUAL(LENGTH, status->bytes);
    assert_left_alone();
}

static void test_every_byte_arrives_once_and_in_order(void)
{
    static const uint32_t lengths[] = {1, 511, 512, 513, 1024, LENGTH, BANK_HEADER_AT};

    for (unsigned i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
        uint32_t length = lengths[i];

        fake_turret_reset();
        fake_flash_store(SLOT, 1, length, 1, SEED);
        fake_flash_record(SLOT, 0, 0, SLOT_RECORD_DEFAULT, 1);
        fake_fpga.done_byte = length;
        TEST_ASSERT_EQUAL(CONFIG_OK, configure()->result);
        TEST_ASSERT_EQUAL(length, told()->bytes);
        TEST_ASSERT_EQUAL(length, fake_fpga.taken_count);
        TEST_ASSERT_EQUAL_MEMORY(fake_flash.memory + BANK_ADDRESS(SLOT, 1), fake_fpga.taken,
                                 length);
    }
}

static void test_the_time_is_counted_from_the_cpus_start(void)
{
    fake_clock_now_us = 5000;
    TEST_ASSERT_GREATER_THAN(5000, configure()->time_us);
    TEST_ASSERT_EQUAL(fake_clock_now_us, told()->time_us);
}

static void test_a_flash_that_is_still_erasing_is_waited_for(void)
{
    fake_flash.busy_polls = 1000;
    TEST_ASSERT_EQUAL(CONFIG_OK, configure()->result);
}

static void test_a_flash_that_stays_busy_ends_as_no_flash(void)
{
    fake_flash.busy_polls = 1 << 30;
    TEST_ASSERT_EQUAL(CONFIG_NO_FLASH, configure()->result);
    TEST_ASSERT_LESS_THAN(3000000, fake_clock_now_us);
    assert_left_alone();
}

static void test_an_absent_flash_ends_as_no_flash(void)
{
    fake_flash.present = 0;
    TEST_ASSERT_EQUAL(CONFIG_NO_FLASH, configure()->result);
    assert_left_alone();
}

static void test_without_default_slot_nothing_is_configured(void)
{
    fake_flash.memory[BANK_ADDRESS(SLOT, 0) + BANK_RECORDS_AT] = 0;
    TEST_ASSERT_EQUAL(CONFIG_NO_DEFAULT, configure()->result);
    TEST_ASSERT_EQUAL(CONFIG_NO_SLOT, told()->slot);
    assert_left_alone();
}

static void test_a_default_slot_without_bitstream_is_named(void)
{
    fake_flash.memory[BANK_ADDRESS(SLOT, 0) + BANK_COMMIT_AT] = 0;
    TEST_ASSERT_EQUAL(CONFIG_BAD_SLOT, configure()->result);
    TEST_ASSERT_EQUAL(SLOT, told()->slot);
    assert_left_alone();
}

static void test_the_running_design_survives_when_there_is_nothing_to_load(void)
{
    TEST_ASSERT_EQUAL(CONFIG_OK, configure()->result);
    fake_flash.memory[BANK_ADDRESS(SLOT, 0) + BANK_COMMIT_AT] = 0;
    TEST_ASSERT_EQUAL(CONFIG_BAD_SLOT, configure()->result);
    TEST_ASSERT_EQUAL(1, told()->done);
    TEST_ASSERT_EQUAL(0, told()->bytes);
}

static void test_an_absent_fpga_is_noticed(void)
{
    fake_fpga.present = 0;
    assert_fails_clean(CONFIG_NO_INIT);
}

static void test_an_fpga_that_never_clears_is_noticed(void)
{
    fake_fpga.clears = 0;
    assert_fails_clean(CONFIG_NO_INIT);
}

static void test_init_falling_at_any_byte_is_a_crc_error(void)
{
    for (uint32_t at = 1; at < LENGTH; at += 20011) {
        fake_fpga.bad_byte = at;
        assert_fails_clean(CONFIG_CRC_ERROR);
        TEST_ASSERT_LESS_OR_EQUAL(at + 17 * TURRET_FLASH_BLOCK, told()->bytes);
    }
}

static void test_init_falling_with_the_last_byte_is_a_crc_error(void)
{
    fake_fpga.bad_byte = LENGTH;
    assert_fails_clean(CONFIG_CRC_ERROR);
    TEST_ASSERT_EQUAL(LENGTH, told()->bytes);
}

static void test_done_staying_low_is_noticed(void)
{
    fake_fpga.done_byte = FAKE_NEVER;
    assert_fails_clean(CONFIG_NO_DONE);
}

static void test_a_block_that_does_not_end_is_given_up(void)
{
    fake_fpga.stream_sticks = 1;
    assert_fails_clean(CONFIG_BUS_STUCK);
    fake_fpga.stream_sticks = 0;
    TEST_ASSERT_EQUAL(CONFIG_OK, configure()->result);
}

static void test_it_can_start_again_at_any_step(void)
{
    for (int steps = 0; steps < 40; steps++) {
        configure_start();
        for (int i = 0; i < steps; i++)
            configure_step();
        TEST_ASSERT_EQUAL(CONFIG_OK, configure()->result);
        TEST_ASSERT_EQUAL(LENGTH, fake_fpga.taken_count);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_good_bitstream_brings_the_fpga_up);
    RUN_TEST(test_every_byte_arrives_once_and_in_order);
    RUN_TEST(test_the_time_is_counted_from_the_cpus_start);
    RUN_TEST(test_a_flash_that_is_still_erasing_is_waited_for);
    RUN_TEST(test_a_flash_that_stays_busy_ends_as_no_flash);
    RUN_TEST(test_an_absent_flash_ends_as_no_flash);
    RUN_TEST(test_without_default_slot_nothing_is_configured);
    RUN_TEST(test_a_default_slot_without_bitstream_is_named);
    RUN_TEST(test_the_running_design_survives_when_there_is_nothing_to_load);
    RUN_TEST(test_an_absent_fpga_is_noticed);
    RUN_TEST(test_an_fpga_that_never_clears_is_noticed);
    RUN_TEST(test_init_falling_at_any_byte_is_a_crc_error);
    RUN_TEST(test_init_falling_with_the_last_byte_is_a_crc_error);
    RUN_TEST(test_done_staying_low_is_noticed);
    RUN_TEST(test_a_block_that_does_not_end_is_given_up);
    RUN_TEST(test_it_can_start_again_at_any_step);
    return UNITY_END();
}
