// sources: fx2-firmware/app/flash_chip.c host-tests/fx2-firmware/fakes/fake_turret.c
// includes: fx2-firmware
#include "app/flash_chip.h"
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
    TEST_ASSERT_EQUAL(FLASH_OK, flash_chip_identify());
}

static void test_the_chip_reads_its_array_afterwards(void)
{
    flash_chip_identify();
    TEST_ASSERT_FALSE(fake_flash.cfi_mode);
}

static void test_a_chip_left_in_cfi_mode_is_known(void)
{
    fake_flash.cfi_mode = 1;
    TEST_ASSERT_EQUAL(FLASH_OK, flash_chip_identify());
    TEST_ASSERT_FALSE(fake_flash.cfi_mode);
}

static void test_no_chip_is_absent(void)
{
    fake_flash.present = 0;
    TEST_ASSERT_EQUAL(FLASH_ABSENT, flash_chip_identify());
}

static void test_another_size_is_wrong(void)
{
    fake_flash.size_code = 23;
    TEST_ASSERT_EQUAL(FLASH_WRONG, flash_chip_identify());
    TEST_ASSERT_FALSE(fake_flash.cfi_mode);
}

static void test_another_command_set_is_wrong(void)
{
    fake_flash.command_set = 1;
    TEST_ASSERT_EQUAL(FLASH_WRONG, flash_chip_identify());
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
    return UNITY_END();
}
