// sources: fx2-firmware/app/flash_chip.c host-tests/fx2-firmware/fakes/fake_turret.c
// sources: host-tests/fx2-firmware/fakes/fake_clock.c
// includes: fx2-firmware
#include "app/flash_chip.h"
#include "drivers/flash_bus.h"
#include "host-tests/fx2-firmware/fakes/fake_turret.h"

#include <unity.h>

void setUp(void)
{
    fake_turret_reset();
    fake_flash.selected = 1;
}

void tearDown(void) {}

static void test_the_right_chip_is_known(void)
{
    TEST_ASSERT_TRUE(flash_chip_identify());
}

static void test_the_chip_reads_its_array_afterwards(void)
{
    flash_chip_identify();
    TEST_ASSERT_FALSE(fake_flash.cfi_mode);
}

static void test_a_chip_left_in_cfi_mode_is_known(void)
{
    fake_flash.cfi_mode = 1;
    TEST_ASSERT_TRUE(flash_chip_identify());
    TEST_ASSERT_FALSE(fake_flash.cfi_mode);
}

static void test_no_chip_is_absent(void)
{
    fake_flash.present = 0;
    TEST_ASSERT_FALSE(flash_chip_identify());
}

static void test_another_size_is_wrong(void)
{
    fake_flash.size_code = 23;
    TEST_ASSERT_FALSE(flash_chip_identify());
    TEST_ASSERT_FALSE(fake_flash.cfi_mode);
}

static void test_another_command_set_is_wrong(void)
{
    fake_flash.command_set = 1;
    TEST_ASSERT_FALSE(flash_chip_identify());
}

static const uint8_t pattern[FLASH_PAGE] = {1, 2, 3, 4, 5, 6, 7, 8};

static void test_a_page_is_programmed_and_the_address_moves_behind_it(void)
{
    flash_at_block = 0x1234;
    flash_at_offset = 512 - 64;
    TEST_ASSERT_EQUAL(STORE_OK, flash_chip_program(pattern, FLASH_PAGE));
    TEST_ASSERT_EQUAL(512, flash_at_offset);
    TEST_ASSERT_EQUAL_MEMORY(pattern, fake_flash.memory + 0x1234ul * 512 + 448, FLASH_PAGE);
    TEST_ASSERT_EQUAL(1, fake_flash.operations);
}

static void test_any_part_of_a_page_can_be_programmed(void)
{
    for (uint8_t at = 0; at < 8; at++) {
        for (uint8_t length = 1; length <= 8 - at; length++) {
            fake_turret_reset();
            fake_flash.selected = 1;
            flash_at_block = 0;
            flash_at_offset = (uint16_t)(128 + at);
            TEST_ASSERT_EQUAL(STORE_OK, flash_chip_program(pattern, length));
            TEST_ASSERT_EQUAL_MEMORY(pattern, fake_flash.memory + 128 + at, length);
            TEST_ASSERT_EQUAL_HEX8(0xFF, fake_flash.memory[128 + at + length]);
        }
    }
}

static void test_bits_that_would_have_to_be_set_are_a_failure(void)
{
    flash_at_block = 7;
    flash_at_offset = 0;
    fake_flash.memory[7 * 512 + 3] = 0;
    TEST_ASSERT_EQUAL(STORE_PROGRAM_FAILED, flash_chip_program(pattern, 8));
    TEST_ASSERT_FALSE(fake_flash.failed); /* it has been reset */
}

static void test_programming_that_fails_or_never_ends_is_told(void)
{
    flash_at_block = 7;
    flash_at_offset = 0;
    fake_flash.fail_at = 0;
    TEST_ASSERT_EQUAL(STORE_PROGRAM_FAILED, flash_chip_program(pattern, 8));
    fake_flash.busy_for_each = 1 << 30;
    flash_at_offset = 64;
    TEST_ASSERT_EQUAL(STORE_TIMEOUT, flash_chip_program(pattern, 8));
}

static void test_an_erased_sector_is_told_from_one_that_is_not(void)
{
    flash_at_block = 0x80;
    flash_at_offset = 0;
    fake_flash.memory[0x10000] = 0;
    flash_chip_erase();
    TEST_ASSERT_TRUE(flash_chip_erased());
    TEST_ASSERT_EQUAL_HEX8(0xFF, fake_flash.memory[0x10000]);
    fake_flash.fail_at = 1;
    flash_chip_erase();
    TEST_ASSERT_FALSE(flash_chip_erased());
    TEST_ASSERT_FALSE(fake_flash.failed);
}

static void test_a_chip_left_in_the_middle_of_a_write_is_known(void)
{
    for (int writes = 0; writes < 12; writes++) {
        fake_turret_reset();
        fake_flash.selected = 1;
        flash_at_block = 0x300;
        flash_at_offset = 0;
        flash_bus_command(0xAAA, 0xAA);
        flash_bus_command(0x555, 0x55);
        flash_bus_write(0x25);
        flash_bus_write(11);
        for (int i = 0; i < writes; i++, flash_at_offset++)
            flash_bus_write(0x5A);
        TEST_ASSERT_TRUE(flash_chip_identify());
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_right_chip_is_known);
    RUN_TEST(test_the_chip_reads_its_array_afterwards);
    RUN_TEST(test_a_chip_left_in_cfi_mode_is_known);
    RUN_TEST(test_no_chip_is_absent);
    RUN_TEST(test_another_size_is_wrong);
    RUN_TEST(test_another_command_set_is_wrong);
    RUN_TEST(test_a_page_is_programmed_and_the_address_moves_behind_it);
    RUN_TEST(test_any_part_of_a_page_can_be_programmed);
    RUN_TEST(test_bits_that_would_have_to_be_set_are_a_failure);
    RUN_TEST(test_programming_that_fails_or_never_ends_is_told);
    RUN_TEST(test_an_erased_sector_is_told_from_one_that_is_not);
    RUN_TEST(test_a_chip_left_in_the_middle_of_a_write_is_known);
    return UNITY_END();
}
