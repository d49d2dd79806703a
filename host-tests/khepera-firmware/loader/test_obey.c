// sources: khepera-firmware/loader/obey.c khepera-firmware/drivers/flash.c
// sources: host-tests/khepera-firmware/fakes/fake_flash.c
// includes: khepera-firmware host-tests/khepera-firmware/fakes
/* The loader's requests against a flash in memory: right ones, wrong ones, and random ones. */
#include "loader/obey.h"

#include <string.h>
#include <unity.h>

#include "board/khepera.h"
#include "fake_flash.h"
#include "link/bytes.h"

#define LENGTH 600u

static fake_flash_t chip;
static flash_bus_t bus;
static loader_t loader;
static uint8_t payload[LOADER_PAYLOAD_MAX];
static uint8_t reply[LOADER_PAYLOAD_MAX];
static uint8_t program[3 * LOADER_BLOCK_SIZE];
static unsigned breaths;

static void breathe(void *context)
{
    (void)context;
    breaths++;
}

static void start(void)
{
    loader.bus = &bus;
    loader.memory = chip.cells;
    loader.idle = breathe;
    loader.context = NULL;
    loader_init(&loader);
    loader_survey(&loader);
}

void setUp(void)
{
    unsigned i;

    fake_flash_init(&chip);
    bus = fake_flash_bus(&chip);
    memset(program, 0xFF, sizeof program);
    for (i = 0; i < LENGTH; i++)
        program[i] = (uint8_t)(i * 31u + 7u);
    start();
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, chip.stray_writes);
}

static uint8_t ask(uint8_t type, uint16_t size)
{
    uint16_t count = loader_obey(&loader, type, payload, size, reply);

    TEST_ASSERT_TRUE(count >= 1 && count <= LOADER_PAYLOAD_MAX);
    return reply[0];
}

static uint8_t write_block(uint16_t block)
{
    be_put16(payload, block);
    memcpy(payload + 2, program + (block - 1u) * LOADER_BLOCK_SIZE, LOADER_BLOCK_SIZE);
    return ask(LOADER_WRITE, 2 + LOADER_BLOCK_SIZE);
}

static base_image_t image(uint32_t generation)
{
    base_image_t made;

    memset(&made, 0, sizeof made);
    made.length = LENGTH;
    made.load = BOARD_PROGRAM_BASE;
    made.entry = BOARD_PROGRAM_BASE;
    made.crc32 = crc32_final(crc32_update(CRC32_INIT, program, LENGTH));
    made.generation = generation;
    return made;
}

static uint8_t commit(const base_image_t *header)
{
    base_image_encode(header, payload);
    return ask(LOADER_COMMIT, BASE_IMAGE_HEADER_SIZE);
}

static void put_program(uint32_t generation)
{
    base_image_t header = image(generation);
    uint16_t block;

    payload[0] = 0;
    TEST_ASSERT_EQUAL_UINT8(LOADER_OK, ask(LOADER_ERASE, 1));
    for (block = 1; block <= 3; block++)
        TEST_ASSERT_EQUAL_UINT8(LOADER_OK, write_block(block));
    TEST_ASSERT_EQUAL_UINT8(LOADER_OK, commit(&header));
}

static void test_programs_go_to_the_two_banks_in_turn(void)
{
    TEST_ASSERT_EQUAL_UINT8(LOADER_NO_BANK, loader.active);
    put_program(5);
    TEST_ASSERT_EQUAL_UINT8(0, loader.active);
    put_program(6);
    TEST_ASSERT_EQUAL_UINT8(1, loader.active);
    start();
    TEST_ASSERT_EQUAL_UINT8(1, loader.active);
    TEST_ASSERT_EQUAL_UINT32(6, loader.image.generation);
    put_program(7);
    TEST_ASSERT_EQUAL_UINT8(0, loader.active);
}

static void test_generations_wrap(void)
{
    put_program(0xFFFFFFFFul);
    put_program(0);
    start();
    TEST_ASSERT_EQUAL_UINT32(0, loader.image.generation);
}

static void test_a_newer_image_that_is_damaged_leaves_the_older_one(void)
{
    put_program(1);
    put_program(2);
    chip.cells[BOARD_IMAGE_B + BASE_IMAGE_PROGRAM_AT + 300] ^= 1;
    start();
    TEST_ASSERT_EQUAL_UINT8(0, loader.active);
    chip.cells[BOARD_IMAGE_A + BASE_IMAGE_COMMIT_AT] = 0;
    start();
    TEST_ASSERT_EQUAL_UINT8(LOADER_NO_BANK, loader.active);
}

static void test_a_commit_is_refused_if_anything_is_not_right(void)
{
    base_image_t header;

    put_program(1);
    header = image(1);
    header.crc32++;
    TEST_ASSERT_EQUAL_UINT8(LOADER_BAD_HEADER, commit(&header)); /* not newer */
    header.generation = 2;
    TEST_ASSERT_EQUAL_UINT8(LOADER_BAD_IMAGE, commit(&header));
    header = image(2);
    header.load = BOARD_PROGRAM_BASE - 2;
    TEST_ASSERT_EQUAL_UINT8(LOADER_BAD_HEADER, commit(&header));
    header = image(2);
    header.length = BOARD_IMAGE_BANK_SIZE;
    TEST_ASSERT_EQUAL_UINT8(LOADER_BAD_HEADER, commit(&header));
    header = image(2);
    header.entry = BOARD_PROGRAM_BASE + LENGTH;
    TEST_ASSERT_EQUAL_UINT8(LOADER_BAD_HEADER, commit(&header));
    TEST_ASSERT_EQUAL_UINT8(0, loader.active);
}

static void test_asking_again_is_no_error(void)
{
    base_image_t header = image(2);
    unsigned operations;

    put_program(1);
    put_program(2);
    operations = chip.operations;
    TEST_ASSERT_EQUAL_UINT8(LOADER_OK, commit(&header));
    TEST_ASSERT_EQUAL_UINT(operations, chip.operations);
}

static void test_a_block_that_the_active_bank_has_is_copied(void)
{
    be_put16(payload, 1);
    TEST_ASSERT_EQUAL_UINT8(LOADER_NOT_ACTIVE, ask(LOADER_COPY, 2));
    put_program(1);
    be_put16(payload, 2);
    TEST_ASSERT_EQUAL_UINT8(LOADER_OK, ask(LOADER_COPY, 2));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(program + LOADER_BLOCK_SIZE,
                                 chip.cells + BOARD_IMAGE_B + 2 * LOADER_BLOCK_SIZE,
                                 LOADER_BLOCK_SIZE);
}

static void test_the_header_cannot_be_written_as_a_block(void)
{
    be_put16(payload, 0);
    TEST_ASSERT_EQUAL_UINT8(LOADER_OUT_OF_RANGE, ask(LOADER_WRITE, 2 + LOADER_BLOCK_SIZE));
    TEST_ASSERT_EQUAL_UINT8(LOADER_OUT_OF_RANGE, ask(LOADER_COPY, 2));
    be_put16(payload, BOARD_IMAGE_BANK_SIZE / LOADER_BLOCK_SIZE);
    TEST_ASSERT_EQUAL_UINT8(LOADER_OUT_OF_RANGE, ask(LOADER_WRITE, 2 + LOADER_BLOCK_SIZE));
}

static void test_a_chip_that_fails_is_told(void)
{
    chip.sticks = 1;
    payload[0] = 0;
    TEST_ASSERT_EQUAL_UINT8(LOADER_FLASH_FAILED, ask(LOADER_ERASE, 1));
    TEST_ASSERT_EQUAL_UINT8(LOADER_FLASH_FAILED, write_block(1));
}

static void test_random_requests_touch_nothing_but_the_other_bank(void)
{
    static uint8_t before[BOARD_FLASH_SIZE];
    uint32_t random = 1;
    unsigned turn;
    unsigned i;

    put_program(1);
    memcpy(before, chip.cells, sizeof before);
    for (turn = 0; turn < 20000; turn++) {
        uint16_t size;

        for (i = 0; i < 8; i++) {
            random = random * 1664525u + 1013904223u;
            payload[i] = (uint8_t)(random >> 24);
        }
        random = random * 1664525u + 1013904223u;
        size = (uint16_t)((random >> 8) % (LOADER_PAYLOAD_MAX + 1));
        (void)ask((uint8_t)((random >> 28) % 11u), turn % 3 == 0 ? size : (uint16_t)(size % 5));
    }
    TEST_ASSERT_EQUAL_UINT8(0, loader.active);
    TEST_ASSERT_EQUAL_INT(0, memcmp(before, chip.cells, BOARD_IMAGE_B));
    TEST_ASSERT_EQUAL_INT(0, memcmp(before + BOARD_IMAGE_B + BOARD_IMAGE_BANK_SIZE,
                                    chip.cells + BOARD_IMAGE_B + BOARD_IMAGE_BANK_SIZE,
                                    BOARD_FLASH_SIZE - BOARD_IMAGE_B - BOARD_IMAGE_BANK_SIZE));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_programs_go_to_the_two_banks_in_turn);
    RUN_TEST(test_generations_wrap);
    RUN_TEST(test_a_newer_image_that_is_damaged_leaves_the_older_one);
    RUN_TEST(test_a_commit_is_refused_if_anything_is_not_right);
    RUN_TEST(test_asking_again_is_no_error);
    RUN_TEST(test_a_block_that_the_active_bank_has_is_copied);
    RUN_TEST(test_the_header_cannot_be_written_as_a_block);
    RUN_TEST(test_a_chip_that_fails_is_told);
    RUN_TEST(test_random_requests_touch_nothing_but_the_other_bank);
    return UNITY_END();
}
