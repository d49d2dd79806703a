/* The stream's records and the registers' wire forms, held against the golden bytes of
 * docs/SPEC.md. Runs on the host, big-endian under qemu-m68k and on the 8051 under ucsim. */
#include <string.h>
#include <unity.h>

#include "link/bytes.h"
#include "link/crc.h"
#include "link/registers.h"
#include "link/stream.h"

void setUp(void) {}

void tearDown(void) {}

/* SPEC.md section 7. */
static const uint8_t golden_frame[STREAM_HEADER_SIZE] = {
    0x53, 0x4F, 0x54, 0x46, 0x02, 0x01, 0x01, 0x00, 0x01, 0x40, 0x00, 0xF0, 0x00, 0x00,
    0x03, 0xE8, 0x00, 0x00, 0x03, 0xE4, 0x00, 0x00, 0x00, 0x04, 0x00, 0x07, 0x1C, 0x50,
    0x00, 0x03, 0x04, 0x00, 0x11, 0x2A, 0x00, 0xF1, 0x12, 0x34, 0x09, 0x20, 0x94, 0x5C,
    0x04, 0x50, 0x02, 0xA0, 0x0B, 0x10, 0x01, 0x70, 0x01, 0x60, 0x08, 0xF0, 0x01, 0xA0,
    0x69, 0x6A, 0x6B, 0xC8, 0xFE, 0x05, 0x9F, 0x8C, 0x3C, 0x50, 0x4F, 0x1A, 0x50, 0x3C,
    0x08, 0x05, 0x03, 0x09, 0x04, 0x0C, 0x02, 0x60, 0x10, 0x05, 0x19, 0x80, 0x04, 0x0E,
    0x04, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x22, 0xA7};
static const uint8_t golden_end[STREAM_HEADER_SIZE] = {
    0x53, 0x4F, 0x54, 0x46, 0x02, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x03, 0xE9, 0x00, 0x00, 0x03, 0xE5, 0x00, 0x00, 0x00, 0x04, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x03, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x95, 0x53};

static stream_header_t header;
static uint8_t wire[STREAM_HEADER_SIZE];

static void fill_frame(stream_header_t *frame)
{
    memset(frame, 0, sizeof *frame);
    frame->kind = STREAM_FRAME;
    frame->eye = STREAM_EYE_RIGHT;
    frame->flags = STREAM_FLAG_REPORT;
    frame->width_px = 320;
    frame->height_px = 240;
    frame->number = 1000;
    frame->sent = 996;
    frame->lost = 4;
    frame->exposure_us = 466000ul;
    frame->session = 3;
    frame->params = eye_params_default;
    memcpy(frame->report, golden_frame + 32, REPORT_SIZE); /* SPEC.md section 1 */
}

static void a_frame_has_its_golden_bytes(void)
{
    static stream_header_t expected;

    fill_frame(&expected);
    stream_header_encode(&expected, wire);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden_frame, wire, STREAM_HEADER_SIZE);
    memset(&header, 0, sizeof header);
    TEST_ASSERT_EQUAL_INT(STREAM_OK, stream_header_decode(golden_frame, &header));
    TEST_ASSERT_EQUAL_MEMORY(&expected, &header, sizeof header);
}

static void the_end_has_its_golden_bytes(void)
{
    memset(&header, 0, sizeof header);
    header.kind = STREAM_END;
    header.number = 1001;
    header.sent = 997;
    header.lost = 4;
    header.session = 3;
    stream_header_encode(&header, wire);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden_end, wire, STREAM_HEADER_SIZE);
    TEST_ASSERT_EQUAL_INT(STREAM_OK, stream_header_decode(golden_end, &header));
}

static void any_flipped_bit_is_noticed_and_changes_nothing(void)
{
    static stream_header_t before;
    uint16_t bit;

    fill_frame(&header);
    memcpy(&before, &header, sizeof before);
    memcpy(wire, golden_frame, STREAM_HEADER_SIZE);
    for (bit = 0; bit < STREAM_HEADER_SIZE * 8u; bit++) {
        wire[bit >> 3] ^= (uint8_t)(1u << (bit & 7u));
        TEST_ASSERT_EQUAL_INT(bit < 32 ? STREAM_NO_HEADER : STREAM_BAD_CRC,
                              stream_header_decode(wire, &header));
        wire[bit >> 3] ^= (uint8_t)(1u << (bit & 7u));
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, &header, sizeof before);
}

static stream_error_t decoded_with(uint8_t at, uint8_t value)
{
    memcpy(wire, golden_frame, STREAM_HEADER_SIZE);
    wire[at] = value;
    be_put16(wire + 96, crc16_ccitt(CRC16_INIT, wire, 96));
    return stream_header_decode(wire, &header);
}

static void whole_headers_that_make_no_sense_are_refused(void)
{
    TEST_ASSERT_EQUAL_INT(STREAM_BAD_VERSION, decoded_with(4, 1));
    TEST_ASSERT_EQUAL_INT(STREAM_BAD_VERSION, decoded_with(5, 0));
    TEST_ASSERT_EQUAL_INT(STREAM_BAD_VERSION, decoded_with(5, 3));
    TEST_ASSERT_EQUAL_INT(STREAM_BAD_SIZE, decoded_with(6, 2));
    TEST_ASSERT_EQUAL_INT(STREAM_BAD_VERSION, decoded_with(7, 1));
    TEST_ASSERT_EQUAL_INT(STREAM_BAD_SIZE, decoded_with(8, 0xFF));  /* too wide */
    TEST_ASSERT_EQUAL_INT(STREAM_BAD_SIZE, decoded_with(11, 0));    /* no rows */
    TEST_ASSERT_EQUAL_INT(STREAM_BAD_SIZE, decoded_with(11, 0xF1)); /* no whole packets */
}

static void the_pattern_differs_between_eyes_and_pairs(void)
{
    TEST_ASSERT_EQUAL_HEX16(0, stream_pattern_first(0, STREAM_EYE_LEFT));
    TEST_ASSERT_EQUAL_HEX16(0x5A5A, stream_pattern_first(0, STREAM_EYE_RIGHT));
    TEST_ASSERT_EQUAL_HEX16(0x9E37, stream_pattern_first(1, STREAM_EYE_LEFT));
    TEST_ASSERT_EQUAL_HEX16(0x9E37, stream_pattern_first(0x10001ul, STREAM_EYE_LEFT));
}

/* SPEC.md section 2: what the registers are after configuration, in its order. */
static void the_list_of_registers_is_what_spec_says(void)
{
    static const uint8_t golden[EYE_PARAM_COUNT] = {0x3C, 0x50, 0x4F, 0x1A, 0x50, 0x3C, 0x08,
                                                    0x05, 0x03, 0x09, 0x04, 0x0C, 0x02, 0x60,
                                                    0x10, 0x05, 0x19, 0x80, 0x04, 0x0E, 0x04};
    static uint8_t bytes[EYE_PARAM_COUNT];
    static eye_params_t params;
    uint8_t before = 0;
    uint8_t at = 0;
    uint8_t i;

    eye_params_encode(&eye_params_default, bytes);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden, bytes, EYE_PARAM_COUNT);
    eye_params_decode(golden, &params);
    TEST_ASSERT_EQUAL_MEMORY(&eye_params_default, &params, sizeof params);
    for (i = 0; i < FPGA_REGISTER_COUNT; i++) {
        const fpga_register_t *entry = &fpga_registers[i];

        TEST_ASSERT_TRUE(!i || entry->address > before);
        before = entry->address;
        TEST_ASSERT_TRUE(entry->address < FPGA_REG_CAMERA_TABLE);
        TEST_ASSERT_EQUAL_PTR(entry, fpga_register_find(entry->name));
        if (!entry->is_param)
            continue;
        TEST_ASSERT_EQUAL_UINT16(golden[at++], entry->reset);
        TEST_ASSERT_TRUE(entry->min <= entry->reset && entry->reset <= entry->max);
        TEST_ASSERT_TRUE(entry->max <= 255u);
    }
    TEST_ASSERT_EQUAL_UINT8(EYE_PARAM_COUNT, at);
    TEST_ASSERT_EQUAL_HEX8(FPGA_REG_GOAL_ROW, fpga_register_find("goal_row")->address);
    TEST_ASSERT_EQUAL_HEX8(0x20, fpga_register_find("wall_rows")->address);
    TEST_ASSERT_NULL(fpga_register_find("goal"));
}

/* SPEC.md section 2: goal row = 60. */
static void a_register_is_read_with_its_golden_bytes(void)
{
    static const uint8_t golden[REGISTER_READ_BYTES] = {0x40, 0x04, 0x00, 0x3C, 0xC1, 0x43};
    uint16_t value = 0x5555;
    uint8_t bit;

    register_read_encode(FPGA_REG_GOAL_ROW, 60, wire);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden, wire, REGISTER_READ_BYTES);
    for (bit = 0; bit < REGISTER_READ_BYTES * 8u; bit++) {
        wire[bit >> 3] ^= (uint8_t)(1u << (bit & 7u));
        TEST_ASSERT_EQUAL_INT(0, register_read_decode(wire, &value));
        wire[bit >> 3] ^= (uint8_t)(1u << (bit & 7u));
    }
    TEST_ASSERT_EQUAL_HEX16(0x5555, value);
    TEST_ASSERT_EQUAL_INT(1, register_read_decode(golden, &value));
    TEST_ASSERT_EQUAL_UINT16(60, value);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_frame_has_its_golden_bytes);
    RUN_TEST(the_end_has_its_golden_bytes);
    RUN_TEST(any_flipped_bit_is_noticed_and_changes_nothing);
    RUN_TEST(whole_headers_that_make_no_sense_are_refused);
    RUN_TEST(the_pattern_differs_between_eyes_and_pairs);
    RUN_TEST(the_list_of_registers_is_what_spec_says);
    RUN_TEST(a_register_is_read_with_its_golden_bytes);
    return UNITY_END();
}
