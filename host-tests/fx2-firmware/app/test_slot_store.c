// sources: fx2-firmware/app/slot_store.c fx2-firmware/app/flash_chip.c
// sources: host-tests/fx2-firmware/fakes/fake_clock.c
// sources: host-tests/fx2-firmware/fakes/fake_turret.c
// includes: fx2-firmware
#include "app/flash_chip.h"
#include "app/slot_store.h"
#include "host-tests/fx2-firmware/fakes/fake_turret.h"
#include "link/bytes.h"
#include "link/crc.h"
#include "link/requests.h"

#include <string.h>
#include <unity.h>

#define PLACES ((BANK_SIZE - BANK_RECORDS_AT) / SLOT_RECORD_SIZE)
#define LENGTH 234456u

void setUp(void)
{
    fake_turret_reset();
    fake_flash.selected = 1;
}

void tearDown(void) {}

static uint8_t *bank(uint8_t slot, uint8_t number)
{
    return fake_flash.memory + BANK_ADDRESS(slot, number);
}

static void test_erased_flash_has_no_default(void)
{
    TEST_ASSERT_EQUAL(CONFIG_NO_SLOT, slot_store_marked(SLOT_RECORD_DEFAULT));
}

static void test_looking_for_a_default_in_erased_flash_reads_one_record_a_bank(void)
{
    slot_store_marked(SLOT_RECORD_DEFAULT);
    TEST_ASSERT_EQUAL(SLOT_COUNT * SLOT_BANKS * SLOT_RECORD_SIZE, fake_flash.reads);
}

static void test_every_bank_of_every_slot_can_hold_the_default_record(void)
{
    for (uint8_t slot = 0; slot < SLOT_COUNT; slot++) {
        for (uint8_t number = 0; number < SLOT_BANKS; number++) {
            fake_turret_reset();
            fake_flash.selected = 1;
            fake_flash_record(slot, number, 0, SLOT_RECORD_DEFAULT, 0);
            TEST_ASSERT_EQUAL(slot, slot_store_marked(SLOT_RECORD_DEFAULT));
        }
    }
}

static void test_the_highest_sequence_number_is_the_default(void)
{
    fake_flash_record(3, 0, 0, SLOT_RECORD_DEFAULT, 0x80000001ul);
    fake_flash_record(9, 1, 0, SLOT_RECORD_DEFAULT, 0x80000002ul);
    fake_flash_record(31, 0, 0, SLOT_RECORD_DEFAULT, 0x7FFFFFFFul);
    TEST_ASSERT_EQUAL(9, slot_store_marked(SLOT_RECORD_DEFAULT));
}

static void test_the_newest_record_of_a_bank_counts_wherever_it_ends(void)
{
    for (uint16_t count = 1; count <= PLACES; count++) {
        fake_flash_record(4, 0, (uint16_t)(count - 1), SLOT_RECORD_DEFAULT, 100u + count);
        memset(bank(5, 0) + BANK_RECORDS_AT, 0xFF, SLOT_RECORD_SIZE);
        fake_flash_record(5, 0, 0, SLOT_RECORD_DEFAULT, 100u + count - 1u);
        TEST_ASSERT_EQUAL_MESSAGE(4, slot_store_marked(SLOT_RECORD_DEFAULT),
                                  "a newer record was missed");
        memset(bank(5, 0) + BANK_RECORDS_AT, 0xFF, SLOT_RECORD_SIZE);
        fake_flash_record(5, 0, 0, SLOT_RECORD_DEFAULT, 100u + count + 1u);
        TEST_ASSERT_EQUAL(5, slot_store_marked(SLOT_RECORD_DEFAULT));
    }
}

static void test_a_golden_record_is_no_default(void)
{
    fake_flash_record(2, 0, 0, SLOT_RECORD_DEFAULT, 1);
    fake_flash_record(2, 0, 1, SLOT_RECORD_GOLDEN, 7);
    fake_flash_record(6, 0, 0, SLOT_RECORD_GOLDEN, 8);
    fake_flash_record(7, 0, 0, SLOT_RECORD_DEFAULT, 2);
    TEST_ASSERT_EQUAL(7, slot_store_marked(SLOT_RECORD_DEFAULT));
}

static void test_an_interrupted_record_is_skipped(void)
{
    fake_flash_record(1, 0, 0, SLOT_RECORD_DEFAULT, 5);
    fake_flash_record(1, 0, 1, SLOT_RECORD_DEFAULT, 6);
    bank(1, 0)[BANK_RECORDS_AT + SLOT_RECORD_SIZE + 7] =
        0xFF; /* its last byte was not programmed */
    fake_flash_record(8, 0, 0, SLOT_RECORD_DEFAULT, 4);
    TEST_ASSERT_EQUAL(1, slot_store_marked(SLOT_RECORD_DEFAULT));
    fake_flash_record(8, 0, 1, SLOT_RECORD_DEFAULT, 6);
    TEST_ASSERT_EQUAL(8, slot_store_marked(SLOT_RECORD_DEFAULT));
}

static void test_a_whole_bitstream_is_found_in_either_bank(void)
{
    for (uint8_t number = 0; number < SLOT_BANKS; number++) {
        fake_turret_reset();
        fake_flash.selected = 1;
        fake_flash_store(17, number, LENGTH, 1, 0);
        slot_store_find(17);
        TEST_ASSERT_EQUAL(2 * 17 + number, slot_store_bank);
        TEST_ASSERT_EQUAL(LENGTH, be_get32(slot_store_length));
        TEST_ASSERT_EQUAL(LENGTH / 256, slot_store_length_256);
        TEST_ASSERT_EQUAL(458, slot_store_blocks);
    }
}

static void test_the_higher_generation_counts(void)
{
    fake_flash_store(0, 0, 1000, 0xFFFFFFFFul, 0);
    fake_flash_store(0, 1, 2000, 1, 0);
    slot_store_find(0);
    TEST_ASSERT_EQUAL(1000, be_get32(slot_store_length));
    fake_flash_store(31, 0, 1000, 1, 0);
    fake_flash_store(31, 1, 2000, 2, 0);
    slot_store_find(31);
    TEST_ASSERT_EQUAL(2000, be_get32(slot_store_length));
}

static void test_a_bank_without_commit_word_does_not_count(void)
{
    fake_flash_store(5, 0, 1000, 1, 0);
    fake_flash_store(5, 1, 2000, 2, 0);
    bank(5, 1)[BANK_COMMIT_AT + 3] = 0xFF;
    slot_store_find(5);
    TEST_ASSERT_EQUAL(1000, be_get32(slot_store_length));
}

static void test_any_damaged_byte_of_a_header_rules_its_bank_out(void)
{
    for (uint32_t i = 0; i < SLOT_HEADER_SIZE; i++) {
        fake_flash_store(5, 0, 1000, 1, 0);
        fake_flash_store(5, 1, 2000, 2, 0);
        bank(5, 1)[BANK_HEADER_AT + i] ^= 0x10;
        slot_store_find(5);
        TEST_ASSERT_EQUAL(1000, be_get32(slot_store_length));
    }
}

static void test_an_empty_slot_has_no_bank(void)
{
    slot_store_find(12);
    TEST_ASSERT_EQUAL(NO_BANK, slot_store_bank);
}

static void test_a_bitstream_for_another_part_does_not_count(void)
{
    uint8_t *header = bank(5, 0) + BANK_HEADER_AT;

    fake_flash_store(5, 0, 1000, 1, 0);
    header[20 + 4] = '9';
    be_put16(header + 62, crc16_ccitt(CRC16_INIT, header, 62));
    slot_store_find(5);
    TEST_ASSERT_EQUAL(NO_BANK, slot_store_bank);
}

static void check_length(uint32_t length, int fits)
{
    slot_header_t header = {.length = length, .part = "v300ecs144"};

    slot_header_encode(&header, flash_page);
    TEST_ASSERT_EQUAL(fits, slot_store_header_fits() != 0);
    if (fits)
        TEST_ASSERT_EQUAL((length + 511) / 512, slot_store_blocks);
}

static void test_only_lengths_that_a_bank_holds_fit(void)
{
    check_length(0, 0);
    check_length(BANK_HEADER_AT + 1, 0);
    check_length(0x01000001ul, 0);
    check_length(0xFFFFFFFFul, 0);
    for (uint32_t length = 1; length <= BANK_HEADER_AT; length += 255)
        check_length(length, 1);
    check_length(BANK_HEADER_AT, 1);
}

static void test_appended_records_count_at_once(void)
{
    for (int i = 0; i < 10; i++) {
        uint8_t slot = (uint8_t)(7 * i % 32);

        TEST_ASSERT_EQUAL(STORE_OK, slot_store_append((uint8_t)(2 * slot), SLOT_RECORD_DEFAULT));
        TEST_ASSERT_EQUAL(slot, slot_store_marked(SLOT_RECORD_DEFAULT));
        TEST_ASSERT_EQUAL(STORE_OK, slot_store_append((uint8_t)(2 * slot), SLOT_RECORD_GOLDEN));
        TEST_ASSERT_EQUAL(slot, slot_store_marked(SLOT_RECORD_GOLDEN));
    }
}

static void test_a_full_bank_takes_no_record(void)
{
    for (uint16_t place = 0; place < PLACES; place++)
        fake_flash_record(4, 0, place, SLOT_RECORD_DEFAULT, place);
    TEST_ASSERT_EQUAL(STORE_RECORDS_FULL, slot_store_append(8, SLOT_RECORD_DEFAULT));
    TEST_ASSERT_EQUAL(0, fake_flash.operations);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_erased_flash_has_no_default);
    RUN_TEST(test_looking_for_a_default_in_erased_flash_reads_one_record_a_bank);
    RUN_TEST(test_every_bank_of_every_slot_can_hold_the_default_record);
    RUN_TEST(test_the_highest_sequence_number_is_the_default);
    RUN_TEST(test_the_newest_record_of_a_bank_counts_wherever_it_ends);
    RUN_TEST(test_a_golden_record_is_no_default);
    RUN_TEST(test_an_interrupted_record_is_skipped);
    RUN_TEST(test_a_whole_bitstream_is_found_in_either_bank);
    RUN_TEST(test_the_higher_generation_counts);
    RUN_TEST(test_a_bank_without_commit_word_does_not_count);
    RUN_TEST(test_any_damaged_byte_of_a_header_rules_its_bank_out);
    RUN_TEST(test_an_empty_slot_has_no_bank);
    RUN_TEST(test_a_bitstream_for_another_part_does_not_count);
    RUN_TEST(test_only_lengths_that_a_bank_holds_fit);
    RUN_TEST(test_appended_records_count_at_once);
    RUN_TEST(test_a_full_bank_takes_no_record);
    return UNITY_END();
}
