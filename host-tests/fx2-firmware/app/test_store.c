// sources: fx2-firmware/app/store.c fx2-firmware/app/slot_store.c fx2-firmware/app/flash_chip.c
// sources: host-tests/fx2-firmware/fakes/fake_turret.c host-tests/fx2-firmware/fakes/fake_clock.c
// sources: host-tests/fx2-firmware/fakes/fake_usb.c
// includes: fx2-firmware
/* Jobs on the bitstream store, and what a power cut during any operation of the flash leaves. */
#define _DEFAULT_SOURCE
#include "app/flash_chip.h"
#include "app/slot_store.h"
#include "app/store.h"
#include "drivers/usb.h"
#include "drivers/usb_bulk.h"
#include "host-tests/fx2-firmware/fakes/fake_clock.h"
#include "host-tests/fx2-firmware/fakes/fake_turret.h"
#include "host-tests/fx2-firmware/fakes/fake_usb.h"
#include "link/crc.h"

#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include <unity.h>

#define SLOT      5
#define LENGTH    700u /* of the new bitstream: some pages */
#define STEPS_MAX 1000000l

static uint8_t stream[BANK_HEADER_AT + 600];

void setUp(void)
{
    fake_turret_reset();
    fake_clock_now_us = 0;
    fake_usb_high_speed = 1;
    fake_usb_in_full = 0;
    usb_bulk_packet = 512;
    fake_usb_bulk_halted_out = 0;
    fake_usb_bulk_halted_in = 0;
    for (uint32_t i = 0; i < sizeof stream; i++)
        stream[i] = (uint8_t)(i * 13u + 5u);
}

void tearDown(void) {}

static const store_status_t *told(void)
{
    static store_status_t status;

    TEST_ASSERT_EQUAL(1, store_status_decode(store_status(), &status));
    return &status;
}

static uint8_t begin(uint8_t request, uint16_t value, uint16_t index)
{
    usb_setup.number = request;
    usb_setup.value = value;
    usb_setup.index = index;
    return store_begin();
}

static uint8_t begin_write(uint16_t slot, uint32_t length)
{
    slot_header_t header = {.length = length, .part = "v300ecs144", .name = "new"};

    header.crc32 = crc32_final(crc32_update(CRC32_INIT, stream, (uint16_t)length));
    slot_header_encode(&header, flash_page);
    memcpy(slot_store_header, flash_page, SLOT_HEADER_SIZE);
    fake_usb_out = stream;
    fake_usb_out_left = length;
    return begin(REQUEST_STORE_WRITE, slot, 0);
}

static uint8_t run_to_end(void)
{
    long steps = 0;

    while (store_step())
        TEST_ASSERT_TRUE_MESSAGE(++steps < STEPS_MAX, "it does not end");
    TEST_ASSERT_FALSE(fake_flash.selected);
    return told()->result;
}

static uint8_t write_slot(uint16_t slot, uint32_t length)
{
    TEST_ASSERT_TRUE(begin_write(slot, length));
    return run_to_end();
}

/* The bank that counts in a slot, NO_BANK if none. */
static uint8_t counting(uint8_t slot)
{
    fake_flash.selected = 1;
    slot_store_find(slot);
    fake_flash.selected = 0;
    return slot_store_bank;
}

static uint8_t marked(uint8_t kind)
{
    uint8_t slot;

    fake_flash.selected = 1;
    slot = slot_store_marked(kind);
    fake_flash.selected = 0;
    return slot;
}

static const uint8_t *bank_memory(uint8_t bank)
{
    return fake_flash.memory + (uint32_t)bank * BANK_SIZE;
}

static void test_a_bitstream_is_written_and_counts(void)
{
    static const uint32_t lengths[] = {1, 63, 64, 65, 511, 512, 513, 700, 1024, 60000};

    for (unsigned i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
        for (int high_speed = 0; high_speed < 2; high_speed++) {
            fake_turret_reset();
            usb_bulk_packet = high_speed ? 512 : 64;
            TEST_ASSERT_EQUAL(STORE_OK, write_slot(SLOT, lengths[i]));
            TEST_ASSERT_EQUAL(2 * SLOT, counting(SLOT));
            TEST_ASSERT_EQUAL_MEMORY(stream, bank_memory(2 * SLOT), lengths[i]);
            TEST_ASSERT_EQUAL_HEX8(0xFF, bank_memory(2 * SLOT)[lengths[i]]);
        }
    }
}

static void test_the_largest_bitstream_leaves_its_header_alone(void)
{
    TEST_ASSERT_EQUAL(STORE_OK, write_slot(31, BANK_HEADER_AT));
    TEST_ASSERT_EQUAL(62, counting(31));
    TEST_ASSERT_EQUAL_MEMORY(stream, bank_memory(62), BANK_HEADER_AT);
}

static void test_writes_go_to_the_other_bank_with_a_higher_generation(void)
{
    for (int i = 0; i < 6; i++) {
        TEST_ASSERT_EQUAL(STORE_OK, write_slot(SLOT, LENGTH));
        TEST_ASSERT_EQUAL(2 * SLOT + (i & 1), counting(SLOT));
    }
}

static void test_marks_survive_any_number_of_writes(void)
{
    write_slot(SLOT, LENGTH);
    TEST_ASSERT_TRUE(begin(REQUEST_STORE_MARK, SLOT, SLOT_RECORD_DEFAULT));
    TEST_ASSERT_EQUAL(STORE_OK, run_to_end());
    TEST_ASSERT_TRUE(begin(REQUEST_STORE_MARK, SLOT, SLOT_RECORD_GOLDEN));
    TEST_ASSERT_EQUAL(STORE_OK, run_to_end());
    for (int i = 0; i < 6; i++) {
        TEST_ASSERT_EQUAL(STORE_OK, write_slot(SLOT, LENGTH));
        TEST_ASSERT_EQUAL(SLOT, marked(SLOT_RECORD_DEFAULT));
        TEST_ASSERT_EQUAL(SLOT, marked(SLOT_RECORD_GOLDEN));
        TEST_ASSERT_EQUAL(SLOT, told()->default_slot);
        TEST_ASSERT_EQUAL(SLOT, told()->golden_slot);
    }
}

static void test_erasing_empties_both_banks_and_nothing_else(void)
{
    fake_flash_store(SLOT - 1, 1, 300, 1, 1);
    fake_flash_store(SLOT + 1, 0, 300, 1, 2);
    fake_flash_store(SLOT, 0, 300, 7, 3);
    fake_flash_store(SLOT, 1, 300, 8, 4);
    TEST_ASSERT_TRUE(begin(REQUEST_STORE_ERASE, SLOT, 0));
    TEST_ASSERT_EQUAL(STORE_OK, run_to_end());
    for (uint32_t i = 0; i < SLOT_SIZE; i++)
        TEST_ASSERT_EQUAL_HEX8(0xFF, fake_flash.memory[SLOT * SLOT_SIZE + i]);
    TEST_ASSERT_EQUAL(2 * SLOT - 1, counting(SLOT - 1));
    TEST_ASSERT_EQUAL(2 * SLOT + 2, counting(SLOT + 1));
}

static void test_only_a_slot_with_a_bitstream_can_be_marked(void)
{
    TEST_ASSERT_TRUE(begin(REQUEST_STORE_MARK, SLOT, SLOT_RECORD_DEFAULT));
    TEST_ASSERT_EQUAL(STORE_EMPTY_SLOT, run_to_end());
    TEST_ASSERT_EQUAL(CONFIG_NO_SLOT, told()->default_slot);
}

static void test_blocks_are_read_as_they_are(void)
{
    for (int high_speed = 0; high_speed < 2; high_speed++) {
        usb_bulk_packet = high_speed ? 512 : 64;
        memcpy(fake_flash.memory + 0x20000, stream, 2048);
        TEST_ASSERT_TRUE(begin(REQUEST_STORE_READ, 0x100, 4));
        TEST_ASSERT_EQUAL(STORE_OK, run_to_end());
        TEST_ASSERT_EQUAL(2048, fake_usb_in_count);
        TEST_ASSERT_EQUAL(2048, told()->bytes);
        TEST_ASSERT_EQUAL_MEMORY(stream, fake_usb_in, 2048);
    }
}

static void test_ill_formed_jobs_are_refused(void)
{
    static const uint16_t reads[][2] = {{0, 0},           {0x8000, 1},      {0x7FFF, 2},
                                        {0xFFFF, 1},      {0xFFFF, 0xFFFF}, {0, 0x8001},
                                        {0x10, 0xFFF8},   {1, 0x8000},      {0x7FFF, 0xFFFF},
                                        {0x8000, 0x8000}, {0, 0xFFFF}};

    for (unsigned i = 0; i < sizeof reads / sizeof reads[0]; i++)
        TEST_ASSERT_FALSE(begin(REQUEST_STORE_READ, reads[i][0], reads[i][1]));
    TEST_ASSERT_FALSE(begin(REQUEST_STORE_ERASE, 32, 0));
    TEST_ASSERT_FALSE(begin(REQUEST_STORE_ERASE, 0x0100, 0));
    TEST_ASSERT_FALSE(begin(REQUEST_STORE_MARK, 1, 'X'));
    TEST_ASSERT_FALSE(begin(REQUEST_STORE_MARK, 1, 0x0144));
    TEST_ASSERT_FALSE(begin_write(32, 100));
    begin_write(1, 100);
    run_to_end();
    slot_store_header[9] ^= 1;
    memcpy(flash_page, slot_store_header, SLOT_HEADER_SIZE);
    TEST_ASSERT_FALSE(begin(REQUEST_STORE_WRITE, 1, 0));
    TEST_ASSERT_FALSE(store_busy());
}

static void test_the_last_blocks_can_be_read(void)
{
    TEST_ASSERT_TRUE(begin(REQUEST_STORE_READ, 0x7FF0, 16));
    TEST_ASSERT_EQUAL(STORE_OK, run_to_end());
    TEST_ASSERT_EQUAL(16 * 512, fake_usb_in_count);
}

/* ---- failures ---- */

static void test_a_host_that_stops_sending_or_fetching_is_given_up(void)
{
    begin_write(SLOT, LENGTH);
    fake_usb_out_left = LENGTH - 1;
    TEST_ASSERT_EQUAL(STORE_NO_DATA, run_to_end());
    TEST_ASSERT_TRUE(fake_usb_bulk_halted_out);
    TEST_ASSERT_EQUAL(NO_BANK, counting(SLOT));
    fake_usb_in_full = 1;
    begin(REQUEST_STORE_READ, 0, 4);
    TEST_ASSERT_EQUAL(STORE_NO_DATA, run_to_end());
    TEST_ASSERT_TRUE(fake_usb_bulk_halted_in);
}

static void test_more_than_announced_is_not_committed(void)
{
    static const uint32_t more[] = {1, 60, 512, 600};

    for (unsigned i = 0; i < sizeof more / sizeof more[0]; i++) {
        begin_write(SLOT, LENGTH);
        fake_usb_out_left = LENGTH + more[i];
        TEST_ASSERT_EQUAL(STORE_TOO_LONG, run_to_end());
        TEST_ASSERT_EQUAL(NO_BANK, counting(SLOT));
    }
}

static void test_an_abort_at_any_step_keeps_the_old_bitstream(void)
{
    fake_flash_store(SLOT, 0, 300, 7, 3);
    for (int steps = 0; steps < 40; steps++) {
        begin_write(SLOT, 60000);
        for (int i = 0; i < steps; i++)
            store_step();
        store_abort();
        TEST_ASSERT_EQUAL(STORE_ABORTED, told()->result);
        TEST_ASSERT_FALSE(store_busy());
        TEST_ASSERT_EQUAL(2 * SLOT, counting(SLOT));
    }
}

static void test_erasing_and_marking_are_not_aborted(void)
{
    begin(REQUEST_STORE_ERASE, SLOT, 0);
    store_step();
    store_abort();
    TEST_ASSERT_EQUAL(STORE_OK, run_to_end());
}

static void test_every_failing_operation_of_a_write_is_told(void)
{
    long operations;

    fake_flash_store(SLOT, 0, 300, 7, 3);
    fake_flash_record(SLOT, 1, 0, SLOT_RECORD_DEFAULT, 1);
    write_slot(SLOT, LENGTH);
    operations = fake_flash.operations;
    TEST_ASSERT_GREATER_THAN(15, operations);
    for (long at = 0; at < operations; at++) {
        uint8_t result;

        fake_turret_reset();
        fake_flash_store(SLOT, 0, 300, 7, 3);
        fake_flash_record(SLOT, 1, 0, SLOT_RECORD_DEFAULT, 1);
        fake_flash.fail_at = at;
        result = write_slot(SLOT, LENGTH);
        TEST_ASSERT_TRUE(result == STORE_ERASE_FAILED || result == STORE_PROGRAM_FAILED);
        TEST_ASSERT_EQUAL(2 * SLOT, counting(SLOT));
        TEST_ASSERT_EQUAL(SLOT, marked(SLOT_RECORD_DEFAULT));
        TEST_ASSERT_FALSE(fake_flash.failed);
    }
}

static void test_a_flash_that_is_absent_or_never_ready_is_told(void)
{
    fake_flash.present = 0;
    TEST_ASSERT_EQUAL(STORE_NO_FLASH, write_slot(SLOT, LENGTH));
    fake_flash.present = 1;
    fake_flash.busy_polls = 1 << 30;
    fake_clock_step_us = 100;
    begin(REQUEST_STORE_READ, 0, 1);
    TEST_ASSERT_EQUAL(STORE_NO_FLASH, run_to_end());
    TEST_ASSERT_LESS_THAN(15000000, fake_clock_now_us);
    fake_clock_step_us = 10;
}

static void test_a_sector_that_is_never_erased_ends_in_time(void)
{
    fake_clock_step_us = 1000;
    fake_flash_store(SLOT, 1, 300, 7, 3); /* so that bank 0 is erased, without a page before it */
    TEST_ASSERT_TRUE(begin(REQUEST_STORE_ERASE, SLOT, 0));
    store_step();
    store_step();
    fake_flash.busy_polls = 1 << 30;
    while (store_step())
        TEST_ASSERT_LESS_THAN(15000000, fake_clock_now_us);
    fake_clock_step_us = 10;
    fake_flash.busy_polls = 0;
    TEST_ASSERT_EQUAL(STORE_TIMEOUT, told()->result);
}

/* ---- power cuts ---- */

/* The slots around the one in question, as the cut has left them: shared with the child in which
 * the firmware runs, because a child is a firmware freshly started. */
#define REGION_FIRST (SLOT - 1)
#define REGION_SIZE  (3 * SLOT_SIZE)
static uint8_t *region;
static uint8_t before[REGION_SIZE];

static void *region_memory(void)
{
    return fake_flash.memory + REGION_FIRST * SLOT_SIZE;
}

static void power_fails(void)
{
    memcpy(region, region_memory(), REGION_SIZE);
    _exit(1);
}

enum { JOB_WRITE, JOB_ERASE, JOB_MARK_DEFAULT, JOB_MARK_GOLDEN, JOBS };

static void start_job(int job)
{
    if (job == JOB_WRITE)
        begin_write(SLOT, LENGTH);
    else if (job == JOB_ERASE)
        begin(REQUEST_STORE_ERASE, SLOT, 0);
    else
        begin(REQUEST_STORE_MARK, SLOT,
              job == JOB_MARK_DEFAULT ? SLOT_RECORD_DEFAULT : SLOT_RECORD_GOLDEN);
}

/* Run the job in a firmware of its own, with a cut during operation `at`. 1 if it was cut, 0 if it
 * came to its end with STORE_OK. */
static int run_with_cut(int job, long at, int how)
{
    int status;
    pid_t child = fork();

    TEST_ASSERT_TRUE(child >= 0);
    if (child == 0) {
        fake_flash.cut_at = at;
        fake_flash.cut_how = how;
        fake_flash.cut = power_fails;
        start_job(job);
        while (store_step())
            ;
        memcpy(region, region_memory(), REGION_SIZE);
        _exit(told()->result == STORE_OK ? 0 : 2);
    }
    TEST_ASSERT_EQUAL(child, waitpid(child, &status, 0));
    TEST_ASSERT_TRUE(WIFEXITED(status));
    TEST_ASSERT_NOT_EQUAL(2, WEXITSTATUS(status));
    memcpy(region_memory(), region, REGION_SIZE);
    return WEXITSTATUS(status);
}

#define OLD_LENGTH 1500u
#define OLD_SEED   0x21

/* Slot 4 and 6 hold bitstreams; 5 has an old one in bank `bank`, one that does not count any more
 * in the other, and both marks, of which `marks_in_other` lie in the bank that a write erases. */
static void set_scene(uint8_t bank, int marks_in_other)
{
    uint8_t with_marks = marks_in_other ? bank ^ 1u : bank;

    fake_turret_reset();
    fake_flash_store(SLOT - 1, 0, 900, 3, 1);
    fake_flash_record(SLOT - 1, 0, 0, SLOT_RECORD_DEFAULT, 1);
    fake_flash_record(SLOT - 1, 0, 1, SLOT_RECORD_GOLDEN, 1);
    fake_flash_store(SLOT + 1, 1, 900, 3, 2);
    fake_flash_store(SLOT, bank, OLD_LENGTH, 8, OLD_SEED);
    fake_flash_store(SLOT, bank ^ 1u, 400, 7, 0x77);
    fake_flash_record(SLOT, with_marks, 0, SLOT_RECORD_DEFAULT, 5);
    fake_flash_record(SLOT, with_marks, 1, SLOT_RECORD_GOLDEN, 6);
    memcpy(before, region_memory(), REGION_SIZE);
}

/* What counts in the slot: the old bitstream, the new one, nothing; anything else is a mixture. */
enum { HOLDS_NOTHING, HOLDS_OLD, HOLDS_NEW, HOLDS_MIXTURE };

static int holds(void)
{
    uint8_t bank = counting(SLOT);
    const uint8_t *memory = bank_memory(bank);
    slot_header_t header;

    if (bank == NO_BANK)
        return HOLDS_NOTHING;
    slot_header_decode(memory + BANK_HEADER_AT, &header);
    if (header.length == LENGTH && memcmp(memory, stream, LENGTH) == 0)
        return HOLDS_NEW;
    for (uint32_t i = 0; i < OLD_LENGTH; i++) {
        if (header.length != OLD_LENGTH || memory[i] != (uint8_t)(OLD_SEED + 7u * i))
            return HOLDS_MIXTURE;
    }
    return HOLDS_OLD;
}

static void check_after_cut(int job, const char *replay)
{
    int now = holds();

    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(before, region, SLOT_SIZE, replay);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(before + 2 * SLOT_SIZE, region + 2 * SLOT_SIZE, SLOT_SIZE,
                                     replay);
    if (job == JOB_WRITE)
        TEST_ASSERT_TRUE_MESSAGE(now == HOLDS_OLD || now == HOLDS_NEW, replay);
    else if (job == JOB_ERASE)
        TEST_ASSERT_TRUE_MESSAGE(now == HOLDS_OLD || now == HOLDS_NOTHING, replay);
    else
        TEST_ASSERT_TRUE_MESSAGE(now == HOLDS_OLD, replay);
    if (job != JOB_ERASE) {
        TEST_ASSERT_EQUAL_MESSAGE(SLOT, marked(SLOT_RECORD_DEFAULT), replay);
        TEST_ASSERT_EQUAL_MESSAGE(SLOT, marked(SLOT_RECORD_GOLDEN), replay);
    }
}

/* Once more, without a cut: it must come to its end. */
static void check_repeats(int job, const char *replay)
{
    int expected = job == JOB_WRITE ? HOLDS_NEW : job == JOB_ERASE ? HOLDS_NOTHING : HOLDS_OLD;

    TEST_ASSERT_EQUAL_MESSAGE(0, run_with_cut(job, FAKE_NEVER, 0), replay);
    TEST_ASSERT_EQUAL_MESSAGE(expected, holds(), replay);
}

static void cut_everywhere(int job, uint8_t bank, int marks_in_other)
{
    char replay[100];

    for (int how = 0; how < 3; how++) {
        for (long at = 0;; at++) {
            set_scene(bank, marks_in_other);
            snprintf(replay, sizeof replay,
                     "job %d, old in bank %u, marks %d: cut %d at operation %ld", job, bank,
                     marks_in_other, how, at);
            if (!run_with_cut(job, at, how)) {
                TEST_ASSERT_GREATER_THAN_MESSAGE(0, at, "a job without operations");
                break;
            }
            check_after_cut(job, replay);
            /* An erased slot has no bitstream to mark. */
            if (holds() != HOLDS_NOTHING || job < JOB_MARK_DEFAULT)
                check_repeats(job, replay);
        }
    }
}

static void test_a_power_cut_at_any_operation_leaves_old_empty_or_new(void)
{
    region = mmap(NULL, REGION_SIZE, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    TEST_ASSERT_TRUE(region != MAP_FAILED);
    for (int job = 0; job < JOBS; job++) {
        cut_everywhere(job, 0, 0);
        cut_everywhere(job, 0, 1);
        cut_everywhere(job, 1, 1);
    }
    munmap(region, REGION_SIZE);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_power_cut_at_any_operation_leaves_old_empty_or_new);
    RUN_TEST(test_a_bitstream_is_written_and_counts);
    RUN_TEST(test_the_largest_bitstream_leaves_its_header_alone);
    RUN_TEST(test_writes_go_to_the_other_bank_with_a_higher_generation);
    RUN_TEST(test_marks_survive_any_number_of_writes);
    RUN_TEST(test_erasing_empties_both_banks_and_nothing_else);
    RUN_TEST(test_only_a_slot_with_a_bitstream_can_be_marked);
    RUN_TEST(test_blocks_are_read_as_they_are);
    RUN_TEST(test_ill_formed_jobs_are_refused);
    RUN_TEST(test_the_last_blocks_can_be_read);
    RUN_TEST(test_a_host_that_stops_sending_or_fetching_is_given_up);
    RUN_TEST(test_more_than_announced_is_not_committed);
    RUN_TEST(test_an_abort_at_any_step_keeps_the_old_bitstream);
    RUN_TEST(test_erasing_and_marking_are_not_aborted);
    RUN_TEST(test_every_failing_operation_of_a_write_is_told);
    RUN_TEST(test_a_flash_that_is_absent_or_never_ready_is_told);
    RUN_TEST(test_a_sector_that_is_never_erased_ends_in_time);
    return UNITY_END();
}
