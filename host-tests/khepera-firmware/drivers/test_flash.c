// sources: khepera-firmware/drivers/flash.c host-tests/khepera-firmware/fakes/fake_flash.c
// includes: khepera-firmware host-tests/khepera-firmware/fakes
/* The flash driver against a chip in memory. */
#include "drivers/flash.h"

#include <unity.h>

#include "fake_flash.h"

static fake_flash_t chip;
static flash_bus_t bus;

void setUp(void)
{
    fake_flash_init(&chip);
    bus = fake_flash_bus(&chip);
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, chip.stray_writes);
}

static flash_error_t erase(uint32_t address)
{
    flash_error_t error;
    unsigned polls = 0;

    flash_erase_begin(&bus, address);
    do {
        error = flash_erase_poll(&bus, address);
        TEST_ASSERT_TRUE(++polls < 100);
    } while (error == FLASH_BUSY);
    return error;
}

static void test_a_word_is_programmed_and_its_neighbours_stay(void)
{
    TEST_ASSERT_EQUAL_INT(FLASH_OK, flash_program(&bus, 0x4002, 0x1234));
    TEST_ASSERT_EQUAL_HEX16(0xFFFF, bus.read(bus.context, 0x4000));
    TEST_ASSERT_EQUAL_HEX16(0x1234, bus.read(bus.context, 0x4002));
    TEST_ASSERT_EQUAL_HEX16(0xFFFF, bus.read(bus.context, 0x4004));
}

static void test_what_is_there_costs_no_operation(void)
{
    TEST_ASSERT_EQUAL_INT(FLASH_OK, flash_program(&bus, 0x4002, 0x1234));
    TEST_ASSERT_EQUAL_INT(FLASH_OK, flash_program(&bus, 0x4002, 0x1234));
    TEST_ASSERT_EQUAL_INT(FLASH_OK, flash_program(&bus, 0x4004, 0xFFFF));
    TEST_ASSERT_EQUAL_UINT(1, chip.operations);
}

static void test_a_zero_does_not_become_a_one_without_an_erase(void)
{
    TEST_ASSERT_EQUAL_INT(FLASH_OK, flash_program(&bus, 0x6000, 0x00FF));
    TEST_ASSERT_EQUAL_INT(FLASH_FAILED, flash_program(&bus, 0x6000, 0x01FF));
    TEST_ASSERT_EQUAL_UINT(1, chip.operations);
    TEST_ASSERT_EQUAL_INT(FLASH_OK, erase(0x6000));
    TEST_ASSERT_EQUAL_INT(FLASH_OK, flash_program(&bus, 0x6000, 0x01FF));
}

static void test_an_erase_reaches_one_sector(void)
{
    TEST_ASSERT_EQUAL_INT(FLASH_OK, flash_program(&bus, 0x5FFE, 0));
    TEST_ASSERT_EQUAL_INT(FLASH_OK, flash_program(&bus, 0x6000, 0));
    TEST_ASSERT_EQUAL_INT(FLASH_OK, erase(0x6100));
    TEST_ASSERT_EQUAL_HEX16(0, bus.read(bus.context, 0x5FFE));
    TEST_ASSERT_EQUAL_HEX16(0xFFFF, bus.read(bus.context, 0x6000));
}

static void test_a_chip_that_gives_up_is_told_and_can_be_read_again(void)
{
    chip.sticks = 1;
    TEST_ASSERT_EQUAL_INT(FLASH_FAILED, flash_program(&bus, 0x4000, 0x1200));
    TEST_ASSERT_EQUAL_HEX16(0xFFFF, bus.read(bus.context, 0x4000));
    TEST_ASSERT_EQUAL_INT(FLASH_FAILED, erase(0x4000));
    TEST_ASSERT_EQUAL_UINT(0, chip.busy);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_word_is_programmed_and_its_neighbours_stay);
    RUN_TEST(test_what_is_there_costs_no_operation);
    RUN_TEST(test_a_zero_does_not_become_a_one_without_an_erase);
    RUN_TEST(test_an_erase_reaches_one_sector);
    RUN_TEST(test_a_chip_that_gives_up_is_told_and_can_be_read_again);
    return UNITY_END();
}
