// sources: fx2-firmware/app/configure.c fx2-firmware/app/slot_store.c fx2-firmware/app/flash_chip.c
// sources: host-tests/fx2-firmware/fakes/fake_turret.c host-tests/fx2-firmware/fakes/fake_clock.c
// sources: host-tests/fx2-firmware/fakes/fake_usb.c
// includes: fx2-firmware
#include "app/configure.h"
#include "app/flash_chip.h"
#include "board/turret.h"
#include "drivers/usb.h"
#include "drivers/usb_stream.h"
#include "host-tests/fx2-firmware/fakes/fake_clock.h"
#include "host-tests/fx2-firmware/fakes/fake_turret.h"
#include "host-tests/fx2-firmware/fakes/fake_usb.h"

#include <string.h>

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
    configure_from_flash(CONFIG_BOOT_DEFAULT);
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
        /* The last block is streamed whole. */
        TEST_ASSERT_EQUAL((length + 511) / 512 * 512, fake_fpga.taken_count);
        TEST_ASSERT_EQUAL_MEMORY(fake_flash.memory + BANK_ADDRESS(SLOT, 1), fake_fpga.taken,
                                 length);
    }
}

static void test_the_time_is_counted_from_the_beginning(void)
{
    uint32_t begun = fake_clock_now_us = 5000000;
    uint32_t took = configure()->time_us;

    TEST_ASSERT_UINT32_WITHIN(128, fake_clock_now_us - begun, took);
    TEST_ASSERT_GREATER_THAN(0, took);
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
        TEST_ASSERT_LESS_OR_EQUAL(at + 65 * TURRET_FLASH_BLOCK, told()->bytes);
    }
}

static void test_init_falling_with_the_last_byte_is_a_crc_error(void)
{
    fake_fpga.bad_byte = LENGTH;
    assert_fails_clean(CONFIG_CRC_ERROR);
    TEST_ASSERT_EQUAL((LENGTH + 511) / 512 * 512, told()->bytes);
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

/* ---- the golden slot ---- */

#define GOLDEN 3

static void store_golden(void)
{
    fake_flash_store(GOLDEN, 1, 1000, 1, 0x11);
    fake_flash_record(GOLDEN, 1, 0, SLOT_RECORD_GOLDEN, 1);
}

static void assert_golden_serves(const config_status_t *status, uint8_t cause)
{
    TEST_ASSERT_EQUAL(CONFIG_OK, status->result);
    TEST_ASSERT_EQUAL(CONFIG_FROM_GOLDEN, status->source);
    TEST_ASSERT_EQUAL(cause, status->cause);
    TEST_ASSERT_EQUAL(GOLDEN, status->slot);
    TEST_ASSERT_EQUAL(1000, status->bytes);
    TEST_ASSERT_EQUAL(1, status->done);
    TEST_ASSERT_EQUAL_MEMORY(fake_flash.memory + BANK_ADDRESS(GOLDEN, 1), fake_fpga.taken, 1000);
    assert_left_alone();
}

static void test_the_golden_slot_serves_when_the_default_is_damaged(void)
{
    store_golden();
    fake_fpga.done_byte = 1000; /* the damaged one brings DONE up too early, INIT# tells */
    fake_fpga.bad_byte = 50000;
    assert_golden_serves(configure(), CONFIG_CRC_ERROR);
}

static void test_the_golden_slot_serves_when_there_is_no_default(void)
{
    store_golden();
    fake_fpga.done_byte = 1000;
    fake_flash.memory[BANK_ADDRESS(SLOT, 0) + BANK_RECORDS_AT] = 0;
    assert_golden_serves(configure(), CONFIG_NO_DEFAULT);
}

static void test_a_golden_slot_that_fails_too_leaves_an_erased_fpga(void)
{
    store_golden();
    fake_fpga.bad_byte = 500;
    assert_fails_clean(CONFIG_CRC_ERROR);
    TEST_ASSERT_EQUAL(CONFIG_FROM_GOLDEN, told()->source);
    TEST_ASSERT_EQUAL(CONFIG_CRC_ERROR, told()->cause);
}

static void test_a_named_slot_is_loaded(void)
{
    fake_flash_store(20, 0, 5000, 1, 0x33);
    fake_fpga.done_byte = 5000;
    configure_from_flash(20);
    TEST_ASSERT_EQUAL(CONFIG_OK, run_to_end()->result);
    TEST_ASSERT_EQUAL(CONFIG_FROM_SLOT, told()->source);
    TEST_ASSERT_EQUAL(20, told()->slot);
    TEST_ASSERT_EQUAL(5000, told()->bytes);
}

/* ---- over USB ---- */

static uint8_t stream[LENGTH + 1];

static uint8_t begin_usb(uint8_t kind, uint32_t length)
{
    slot_header_t header = {.length = length, .part = "v300ecs144"};

    slot_header_encode(&header, flash_page);
    for (uint32_t i = 0; i < sizeof stream; i++)
        stream[i] = (uint8_t)(i * 11);
    fake_usb_stream.data = stream;
    fake_usb_stream.length = length;
    return configure_from_usb(kind);
}

static void test_a_bitstream_over_usb_brings_the_fpga_up(void)
{
    TEST_ASSERT_TRUE(begin_usb(CONFIG_BEGIN_FULL, LENGTH));
    TEST_ASSERT_EQUAL(CONFIG_OK, run_to_end()->result);
    TEST_ASSERT_EQUAL(CONFIG_FROM_USB, told()->source);
    TEST_ASSERT_EQUAL(CONFIG_NO_SLOT, told()->slot);
    TEST_ASSERT_EQUAL(LENGTH, told()->bytes);
    TEST_ASSERT_EQUAL(LENGTH, fake_fpga.taken_count);
    TEST_ASSERT_EQUAL_MEMORY(stream, fake_fpga.taken, LENGTH);
    TEST_ASSERT_FALSE(fake_usb_bulk_halted_out);
    assert_left_alone();
}

static void test_a_header_that_does_not_fit_changes_nothing(void)
{
    slot_header_t header = {.length = LENGTH, .part = "v400ecs144"};

    TEST_ASSERT_EQUAL(CONFIG_OK, configure()->result);
    slot_header_encode(&header, flash_page);
    TEST_ASSERT_FALSE(configure_from_usb(CONFIG_BEGIN_FULL));
    begin_usb(CONFIG_BEGIN_FULL, LENGTH);
    configure_abort();
    run_to_end();
    TEST_ASSERT_EQUAL(2, fake_fpga.program_pulses); /* the first configuration, and the abort */
    flash_page[9] ^= 1;
    TEST_ASSERT_FALSE(configure_from_usb(CONFIG_BEGIN_FULL));
    TEST_ASSERT_FALSE(configure_busy());
}

static void test_a_partial_bitstream_leaves_the_design_running(void)
{
    TEST_ASSERT_EQUAL(CONFIG_OK, configure()->result);
    TEST_ASSERT_TRUE(begin_usb(CONFIG_BEGIN_PARTIAL, 5528));
    TEST_ASSERT_EQUAL(CONFIG_OK, run_to_end()->result);
    TEST_ASSERT_EQUAL(CONFIG_PARTIAL, told()->source);
    TEST_ASSERT_EQUAL(1, told()->done);
    TEST_ASSERT_EQUAL(1, fake_fpga.program_pulses);
    assert_left_alone();
}

static void test_a_partial_bitstream_needs_a_running_design(void)
{
    TEST_ASSERT_FALSE(begin_usb(CONFIG_BEGIN_PARTIAL, 5528));
    TEST_ASSERT_FALSE(configure_busy());
}

static void test_a_damaged_partial_bitstream_does_not_stay(void)
{
    TEST_ASSERT_EQUAL(CONFIG_OK, configure()->result);
    begin_usb(CONFIG_BEGIN_PARTIAL, 5528);
    fake_fpga.bad_byte = fake_fpga.taken_count + 5000;
    TEST_ASSERT_EQUAL(CONFIG_CRC_ERROR, run_to_end()->result);
    TEST_ASSERT_EQUAL(0, fake_fpga.done);
}

/* What may happen to a configuration over USB; afterwards the FPGA is erased and the host told. */
static void assert_usb_failed(uint8_t result)
{
    TEST_ASSERT_EQUAL(result, run_to_end()->result);
    TEST_ASSERT_EQUAL(0, fake_fpga.done);
    TEST_ASSERT_EQUAL(0, fake_fpga.taken_count);
    TEST_ASSERT_TRUE(fake_usb_bulk_halted_out);
    fake_usb_bulk_halted_out = 0;
    assert_left_alone();
}

static void test_a_host_that_stops_sending_is_given_up(void)
{
    begin_usb(CONFIG_BEGIN_FULL, LENGTH);
    fake_usb_stream.length = LENGTH - 1;
    assert_usb_failed(CONFIG_NO_DATA);
    TEST_ASSERT_LESS_THAN(5000000, fake_clock_now_us);
}

static void test_a_host_that_sends_too_much_is_told(void)
{
    begin_usb(CONFIG_BEGIN_FULL, LENGTH);
    fake_usb_stream.length = LENGTH + 1;
    assert_usb_failed(CONFIG_TOO_LONG);
}

static void test_an_abort_at_any_step_leaves_an_erased_fpga(void)
{
    for (int steps = 0; steps < 60; steps++) {
        fake_fpga.taken_count = 0;
        begin_usb(CONFIG_BEGIN_FULL, LENGTH);
        fake_usb_stream.sent = 0;
        for (int i = 0; i < steps; i++)
            configure_step();
        configure_abort();
        assert_usb_failed(CONFIG_ABORTED);
    }
}

static void test_an_abort_brings_the_golden_slot(void)
{
    store_golden();
    begin_usb(CONFIG_BEGIN_FULL, LENGTH);
    configure_step();
    fake_fpga.done_byte = 1000;
    configure_abort();
    configure_abort(); /* the golden slot is not aborted */
    assert_golden_serves(run_to_end(), CONFIG_ABORTED);
}

static void test_a_configuration_from_the_flash_is_not_aborted(void)
{
    configure_from_flash(CONFIG_BOOT_DEFAULT);
    for (int i = 0; i < 6; i++) {
        configure_abort();
        configure_step();
    }
    TEST_ASSERT_EQUAL(CONFIG_OK, run_to_end()->result);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_good_bitstream_brings_the_fpga_up);
    RUN_TEST(test_every_byte_arrives_once_and_in_order);
    RUN_TEST(test_the_time_is_counted_from_the_beginning);
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
    RUN_TEST(test_the_golden_slot_serves_when_the_default_is_damaged);
    RUN_TEST(test_the_golden_slot_serves_when_there_is_no_default);
    RUN_TEST(test_a_golden_slot_that_fails_too_leaves_an_erased_fpga);
    RUN_TEST(test_a_named_slot_is_loaded);
    RUN_TEST(test_a_bitstream_over_usb_brings_the_fpga_up);
    RUN_TEST(test_a_header_that_does_not_fit_changes_nothing);
    RUN_TEST(test_a_partial_bitstream_leaves_the_design_running);
    RUN_TEST(test_a_partial_bitstream_needs_a_running_design);
    RUN_TEST(test_a_damaged_partial_bitstream_does_not_stay);
    RUN_TEST(test_a_host_that_stops_sending_is_given_up);
    RUN_TEST(test_a_host_that_sends_too_much_is_told);
    RUN_TEST(test_an_abort_at_any_step_leaves_an_erased_fpga);
    RUN_TEST(test_an_abort_brings_the_golden_slot);
    RUN_TEST(test_a_configuration_from_the_flash_is_not_aborted);
    return UNITY_END();
}
