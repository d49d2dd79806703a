// sources: khepera-firmware/board/crash.c
// includes: khepera-firmware
/* The crash record, and the stack's high-water mark. */
#include "board/crash.h"

#include <stddef.h>
#include <unity.h>

#define STACK_LONGS 64u

/* What the linker script provides on the chip. */
uint32_t test_stack[STACK_LONGS];
__asm__(".globl stack_bottom\n.set stack_bottom, test_stack\n"
        ".globl stack_top\n.set stack_top, test_stack + 256\n");
extern const uint8_t build_id_note[];
const uint8_t build_id_note[16 + BUILD_ID_BYTES] = {[16] = 0x12, [17] = 0x34, [35] = 0x99};
extern uint32_t crash_registers[16];

void setUp(void)
{
    unsigned i;

    for (i = 0; i < STACK_LONGS; i++)
        test_stack[i] = STACK_PAINT;
    for (i = 0; i < 16; i++)
        crash_registers[i] = 0x1000u + i;
    crash_clear();
}

void tearDown(void) {}

/* An address error at 00123456, its frame ending `words` below the stack's top. */
static void crash_with(unsigned words)
{
    uint16_t *frame = (uint16_t *)(void *)&test_stack[STACK_LONGS] - words;
    unsigned i;

    for (i = 0; i < words; i++)
        frame[i] = (uint16_t)(0xF000u + i);
    frame[0] = 0x2700;
    frame[1] = 0x0012;
    frame[2] = 0x3456;
    frame[3] = 0xC00C;
    crash_save(frame);
}

static void a_record_tells_registers_frame_and_build(void)
{
    const crash_record_t *record;

    TEST_ASSERT_NULL(crash_last());
    crash_with(CRASH_FRAME_WORDS);
    record = crash_last();
    TEST_ASSERT_NOT_NULL(record);
    TEST_ASSERT_EQUAL_UINT8(3, crash_vector(record));
    TEST_ASSERT_EQUAL_HEX32(0x00123456, crash_pc(record));
    TEST_ASSERT_EQUAL_HEX32(0x100F, record->registers[15]);
    TEST_ASSERT_EQUAL_HEX16(0xF00B, record->frame[11]);
    TEST_ASSERT_EQUAL_HEX8(0x12, record->build_id[0]);
    TEST_ASSERT_EQUAL_HEX8(0x99, record->build_id[19]);
}

static void a_short_frame_at_the_end_of_the_stack_is_not_read_beyond_it(void)
{
    crash_with(4);
    TEST_ASSERT_EQUAL_HEX16(0xC00C, crash_last()->frame[3]);
    TEST_ASSERT_EQUAL_HEX16(0, crash_last()->frame[4]);
}

static void a_cleared_record_is_gone(void)
{
    crash_with(4);
    crash_clear();
    TEST_ASSERT_NULL(crash_last());
}

static void any_flipped_bit_makes_it_none(void)
{
    unsigned bit;
    uint8_t *bytes;

    crash_with(CRASH_FRAME_WORDS);
    bytes = (uint8_t *)(uintptr_t)crash_last();
    for (bit = 0; bit < 8u * (offsetof(crash_record_t, crc) + 2u); bit++) {
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        TEST_ASSERT_NULL(crash_last());
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
    TEST_ASSERT_NOT_NULL(crash_last());
}

static void the_high_water_mark_is_the_deepest_change(void)
{
    TEST_ASSERT_EQUAL_UINT32(4 * STACK_LONGS, stack_capacity());
    TEST_ASSERT_EQUAL_UINT32(0, stack_high_water());
    test_stack[STACK_LONGS - 10] = 0;
    TEST_ASSERT_EQUAL_UINT32(40, stack_high_water());
    test_stack[0] = 0;
    TEST_ASSERT_EQUAL_UINT32(4 * STACK_LONGS, stack_high_water());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_record_tells_registers_frame_and_build);
    RUN_TEST(a_short_frame_at_the_end_of_the_stack_is_not_read_beyond_it);
    RUN_TEST(a_cleared_record_is_gone);
    RUN_TEST(any_flipped_bit_makes_it_none);
    RUN_TEST(the_high_water_mark_is_the_deepest_change);
    return UNITY_END();
}
