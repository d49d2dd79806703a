/* The wire formats, held against the golden bytes of docs/SPEC.md. Runs on the host, big-endian
 * under qemu-m68k and, with the 8051's compiler, under ucsim. */
#include <string.h>
#include <unity.h>

#include "link/bytes.h"
#include "link/crc.h"
#include "link/eeprom.h"
#include "link/registers.h"
#include "link/report.h"
#include "link/requests.h"
#include "link/slots.h"

void setUp(void) {}

void tearDown(void) {}

static const uint8_t check_text[9] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};

static void test_bytes_are_big_endian(void)
{
    static const uint8_t golden[6] = {0x12, 0x34, 0x89, 0xAB, 0xCD, 0xEF};
    uint8_t wire[6];

    be_put16(wire, 0x1234);
    be_put32(wire + 2, 0x89ABCDEFul);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden, wire, 6);
    TEST_ASSERT_EQUAL_HEX16(0x1234, be_get16(wire));
    TEST_ASSERT_EQUAL_HEX32(0x89ABCDEFul, be_get32(wire + 2));
}

static void test_crcs_have_their_published_check_values(void)
{
    TEST_ASSERT_EQUAL_HEX16(0x29B1, crc16_ccitt(CRC16_INIT, check_text, 9));
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926ul, crc32_final(crc32_update(CRC32_INIT, check_text, 9)));
}

static void test_crcs_may_be_fed_in_pieces(void)
{
    uint16_t crc16 = crc16_ccitt(CRC16_INIT, check_text, 4);
    uint32_t crc32 = crc32_update(CRC32_INIT, check_text, 4);

    TEST_ASSERT_EQUAL_HEX16(0x29B1, crc16_ccitt(crc16, check_text + 4, 5));
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926ul, crc32_final(crc32_update(crc32, check_text + 4, 5)));
}

static void test_crc32_by_table_is_the_same(void)
{
    static uint32_t table[CRC32_TABLE_SIZE];

    crc32_table_fill(table);
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926ul,
                            crc32_final(crc32_update_table(table, CRC32_INIT, check_text, 9)));
}

/* SPEC.md section 1: the reference scene of the paper's Figure 9. */
static const uint8_t golden_report[REPORT_SIZE] = {
    0x11, 0x2A, 0x00, 0xF1, 0x12, 0x34, 0x09, 0x20, 0x94, 0x5C, 0x04, 0x50, 0x02, 0xA0, 0x0B, 0x10,
    0x01, 0x70, 0x01, 0x60, 0x08, 0xF0, 0x01, 0xA0, 0x69, 0x6A, 0x6B, 0xC8, 0xFE, 0x05, 0x9F, 0x8C};

static void fill_reference(report_t *report)
{
    memset(report, 0, sizeof *report);
    report->function = FPGA_FUNCTION_SOCCER;
    report->sequence = 0x2A;
    report->flags = REPORT_BALL | REPORT_GOAL_LEFT_EDGE | REPORT_GOAL_RIGHT_EDGE | REPORT_OPPONENT |
                    REPORT_WALL;
    report->exposure_time = 0x1234;
    report->ball_x_q4 = 146 * 16;
    report->ball_row = 148;
    report->ball_width_px = 92;
    report->ball_disparity_q4 = 69 * 16;
    report->goal_x_q4[0] = 42 * 16;
    report->goal_x_q4[1] = 177 * 16;
    report->goal_disparity_q4[0] = 23 * 16;
    report->goal_disparity_q4[1] = 22 * 16;
    report->opponent_x_q4 = 143 * 16;
    report->opponent_disparity_q4 = 26 * 16;
    report->wall_row[0] = 105;
    report->wall_row[1] = 106;
    report->wall_row[2] = 107;
    report->ball_confidence = 200;
    report->goal_confidence = 15;
    report->opponent_confidence = 14;
    report->delay = 5;
}

static void test_report_encodes_to_its_golden_bytes(void)
{
    report_t report;
    uint8_t wire[REPORT_SIZE];

    fill_reference(&report);
    report_encode(&report, wire);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden_report, wire, REPORT_SIZE);
}

static void test_report_decodes_from_its_golden_bytes(void)
{
    report_t expected;
    report_t report;

    fill_reference(&expected);
    memset(&report, 0, sizeof report);
    TEST_ASSERT_EQUAL_INT(REPORT_OK, report_decode(golden_report, &report));
    TEST_ASSERT_EQUAL_MEMORY(&expected, &report, sizeof report);
}

static void test_report_with_any_single_bit_flipped_is_refused_and_changes_nothing(void)
{
    uint8_t wire[REPORT_SIZE];
    report_t before;
    report_t report;
    uint16_t bit;

    fill_reference(&before);
    memcpy(&report, &before, sizeof report);
    memcpy(wire, golden_report, REPORT_SIZE);
    for (bit = 0; bit < REPORT_SIZE * 8u; bit++) {
        wire[bit >> 3] ^= (uint8_t)(1u << (bit & 7u));
        TEST_ASSERT_EQUAL_INT(REPORT_BAD_CRC, report_decode(wire, &report));
        TEST_ASSERT_EQUAL_MEMORY(&before, &report, sizeof report);
        wire[bit >> 3] ^= (uint8_t)(1u << (bit & 7u));
    }
}

static void test_report_of_an_empty_bus_is_refused(void)
{
    uint8_t wire[REPORT_SIZE];
    report_t report;

    memset(wire, 0xFF, REPORT_SIZE);
    TEST_ASSERT_NOT_EQUAL(REPORT_OK, report_decode(wire, &report));
    memset(wire, 0x00, REPORT_SIZE);
    TEST_ASSERT_NOT_EQUAL(REPORT_OK, report_decode(wire, &report));
}

static void test_report_of_another_version_is_named_so(void)
{
    uint8_t wire[REPORT_SIZE];
    report_t report;

    memcpy(wire, golden_report, REPORT_SIZE);
    wire[0] = 0x21;
    be_put16(wire + 30, crc16_ccitt(CRC16_INIT, wire, 30));
    TEST_ASSERT_EQUAL_INT(REPORT_BAD_VERSION, report_decode(wire, &report));
}

/* SPEC.md section 2: goal row := 61. */
static void test_register_write_has_its_golden_bytes(void)
{
    static const uint8_t golden[REGISTER_WRITE_BYTES] = {0x80, 0x04, 0x00, 0x3D, 0x62, 0xC6};
    uint8_t wire[REGISTER_WRITE_BYTES];
    uint8_t address = 0;
    uint16_t value = 0;

    register_write_encode(FPGA_REG_GOAL_ROW, 61, wire);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden, wire, REGISTER_WRITE_BYTES);
    TEST_ASSERT_EQUAL_INT(1, register_write_decode(golden, &address, &value));
    TEST_ASSERT_EQUAL_UINT8(FPGA_REG_GOAL_ROW, address);
    TEST_ASSERT_EQUAL_UINT16(61, value);
}

static void test_damaged_register_write_changes_nothing(void)
{
    uint8_t wire[REGISTER_WRITE_BYTES];
    uint8_t address = 0x55;
    uint16_t value = 0x5555;
    uint8_t bit;

    register_write_encode(FPGA_REG_GOAL_ROW, 61, wire);
    for (bit = 0; bit < REGISTER_WRITE_BYTES * 8u; bit++) {
        wire[bit >> 3] ^= (uint8_t)(1u << (bit & 7u));
        TEST_ASSERT_EQUAL_INT(0, register_write_decode(wire, &address, &value));
        wire[bit >> 3] ^= (uint8_t)(1u << (bit & 7u));
    }
    TEST_ASSERT_EQUAL_HEX8(0x55, address);
    TEST_ASSERT_EQUAL_HEX16(0x5555, value);
}

/* SPEC.md section 3. */
static const uint8_t golden_header[SLOT_HEADER_SIZE] = {
    'S',  'L',  'O',  'T',  0x01, 0x01, 0x00, 0x00, 0x00, 0x03, 0x93, 0xD8, 0x01, 0x23, 0x45, 0x67,
    0x00, 0x00, 0x00, 0x07, 'v',  '3',  '0',  '0',  'e',  'c',  's',  '1',  '4',  '4',  0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 's',  'o',  'c',  'c',  'e',  'r',  0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xC6, 0x2E};

static void fill_header(slot_header_t *header)
{
    memset(header, 0, sizeof *header);
    header->function = FPGA_FUNCTION_SOCCER;
    header->length = 234456ul;
    header->crc32 = 0x01234567ul;
    header->generation = 7;
    strcpy(header->part, "v300ecs144");
    strcpy(header->name, "soccer");
}

static void test_slot_header_has_its_golden_bytes(void)
{
    uint8_t wire[SLOT_HEADER_SIZE];
    slot_header_t header;
    slot_header_t expected;

    fill_header(&expected);
    slot_header_encode(&expected, wire);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden_header, wire, SLOT_HEADER_SIZE);

    memset(&header, 0, sizeof header);
    TEST_ASSERT_EQUAL_INT(SLOT_OK, slot_header_decode(golden_header, &header));
    TEST_ASSERT_EQUAL_MEMORY(&expected, &header, sizeof header);
}

static void test_slot_header_errors_are_told_apart(void)
{
    uint8_t wire[SLOT_HEADER_SIZE];
    slot_header_t header;

    memset(wire, 0xFF, SLOT_HEADER_SIZE);
    TEST_ASSERT_EQUAL_INT(SLOT_EMPTY, slot_header_decode(wire, &header));

    memcpy(wire, golden_header, SLOT_HEADER_SIZE);
    wire[11] ^= 1u;
    TEST_ASSERT_EQUAL_INT(SLOT_BAD_HEADER, slot_header_decode(wire, &header));

    memcpy(wire, golden_header, SLOT_HEADER_SIZE);
    wire[4] = 2;
    be_put16(wire + 62, crc16_ccitt(CRC16_INIT, wire, 62));
    TEST_ASSERT_EQUAL_INT(SLOT_BAD_VERSION, slot_header_decode(wire, &header));

    memcpy(wire, golden_header, SLOT_HEADER_SIZE);
    be_put32(wire + 8, BANK_HEADER_AT + 1ul);
    be_put16(wire + 62, crc16_ccitt(CRC16_INIT, wire, 62));
    TEST_ASSERT_EQUAL_INT(SLOT_BAD_LENGTH, slot_header_decode(wire, &header));
    be_put32(wire + 8, 0);
    be_put16(wire + 62, crc16_ccitt(CRC16_INIT, wire, 62));
    TEST_ASSERT_EQUAL_INT(SLOT_BAD_LENGTH, slot_header_decode(wire, &header));
}

static void test_slot_texts_too_long_are_cut_and_stay_terminated(void)
{
    slot_header_t header;
    slot_header_t back;
    uint8_t wire[SLOT_HEADER_SIZE];

    fill_header(&header);
    memset(header.name, 'x', SLOT_NAME_SIZE);
    slot_header_encode(&header, wire);
    TEST_ASSERT_EQUAL_INT(SLOT_OK, slot_header_decode(wire, &back));
    TEST_ASSERT_EQUAL_UINT8('x', back.name[SLOT_NAME_SIZE - 2]);
    TEST_ASSERT_EQUAL_UINT8(0, back.name[SLOT_NAME_SIZE - 1]);
}

static void test_slot_records_round_trip_and_show_free_and_damaged_places(void)
{
    static const uint8_t golden[SLOT_RECORD_SIZE] = {'D', 0, 0, 0, 0, 9, 0xF3, 0x88};
    uint8_t wire[SLOT_RECORD_SIZE];
    uint32_t sequence = 0;

    slot_record_encode(SLOT_RECORD_DEFAULT, 9, wire);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden, wire, SLOT_RECORD_SIZE);
    TEST_ASSERT_EQUAL_HEX8(SLOT_RECORD_DEFAULT, slot_record_decode(golden, &sequence));
    TEST_ASSERT_EQUAL_UINT32(9, sequence);

    wire[5] = 10;
    TEST_ASSERT_EQUAL_HEX8(0, slot_record_decode(wire, &sequence));
    TEST_ASSERT_EQUAL_UINT32(9, sequence);
    memset(wire, 0xFF, SLOT_RECORD_SIZE);
    TEST_ASSERT_EQUAL_HEX8(SLOT_RECORD_FREE, slot_record_decode(wire, &sequence));
}

/* SPEC.md section 4. */
static void test_config_status_has_its_golden_bytes(void)
{
    static const uint8_t golden[CONFIG_STATUS_SIZE] = {
        0x01, 0x00, 0x1F, 0x03, 0x00, 0x03, 0x93, 0xD8, 0x00, 0x00, 0x9C, 0x40, 0x04, 0x06, 0, 0};
    config_status_t expected;
    config_status_t status;
    uint8_t wire[CONFIG_STATUS_SIZE];

    memset(&expected, 0, sizeof expected);
    expected.result = CONFIG_OK;
    expected.slot = 31;
    expected.init = 1;
    expected.done = 1;
    expected.bytes = 234456ul;
    expected.time_us = 40000ul;
    expected.source = CONFIG_FROM_GOLDEN;
    expected.cause = CONFIG_CRC_ERROR;
    memset(&status, 0, sizeof status);
    TEST_ASSERT_EQUAL_INT(1, config_status_decode(golden, &status));
    TEST_ASSERT_EQUAL_MEMORY(&expected, &status, sizeof status);

    memcpy(wire, golden, sizeof wire);
    wire[0] = CONFIG_STATUS_VERSION + 1;
    TEST_ASSERT_EQUAL_INT(0, config_status_decode(wire, &status));
}

static void test_store_status_has_its_golden_bytes(void)
{
    static const uint8_t golden[STORE_STATUS_SIZE] = {0x01, 0x01, 0xBA, 0x05, 0x00, 0x03,
                                                      0x90, 0x00, 0xFF, 0x02, 0,    0};
    store_status_t expected;
    store_status_t status;
    uint8_t wire[STORE_STATUS_SIZE];

    memset(&expected, 0, sizeof expected);
    expected.result = STORE_BUSY;
    expected.operation = REQUEST_STORE_WRITE;
    expected.slot = 5;
    expected.bytes = 233472ul;
    expected.default_slot = CONFIG_NO_SLOT;
    expected.golden_slot = 2;
    memset(&status, 0, sizeof status);
    TEST_ASSERT_EQUAL_INT(1, store_status_decode(golden, &status));
    TEST_ASSERT_EQUAL_MEMORY(&expected, &status, sizeof status);

    memcpy(wire, golden, sizeof wire);
    wire[0] = STORE_STATUS_VERSION + 1;
    TEST_ASSERT_EQUAL_INT(0, store_status_decode(wire, &status));
}

static void test_serial_number_has_its_golden_bytes(void)
{
    static const uint8_t golden[EEPROM_SERIAL_SIZE] = {0x53, 0x4E, 0x53, 0x4F, 0x54, 0x30,
                                                       0x30, 0x30, 0x30, 0x30, 0x30, 0x30,
                                                       0x34, 0x32, 0x82, 0x8D};
    uint8_t wire[EEPROM_SERIAL_SIZE];
    uint8_t bit;

    eeprom_serial_encode("SOT000000042", wire);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden, wire, EEPROM_SERIAL_SIZE);
    TEST_ASSERT_EQUAL_UINT8(1, eeprom_serial_check(golden));
    for (bit = 0; bit < 8u * EEPROM_SERIAL_SIZE; bit++) {
        wire[bit >> 3] ^= (uint8_t)(1u << (bit & 7u));
        TEST_ASSERT_EQUAL_UINT8(0, eeprom_serial_check(wire));
        wire[bit >> 3] ^= (uint8_t)(1u << (bit & 7u));
    }
    memset(wire, 0xFF, sizeof wire);
    TEST_ASSERT_EQUAL_UINT8(0, eeprom_serial_check(wire));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bytes_are_big_endian);
    RUN_TEST(test_crcs_have_their_published_check_values);
    RUN_TEST(test_crcs_may_be_fed_in_pieces);
    RUN_TEST(test_crc32_by_table_is_the_same);
    RUN_TEST(test_report_encodes_to_its_golden_bytes);
    RUN_TEST(test_report_decodes_from_its_golden_bytes);
    RUN_TEST(test_report_with_any_single_bit_flipped_is_refused_and_changes_nothing);
    RUN_TEST(test_report_of_an_empty_bus_is_refused);
    RUN_TEST(test_report_of_another_version_is_named_so);
    RUN_TEST(test_register_write_has_its_golden_bytes);
    RUN_TEST(test_damaged_register_write_changes_nothing);
    RUN_TEST(test_slot_header_has_its_golden_bytes);
    RUN_TEST(test_slot_header_errors_are_told_apart);
    RUN_TEST(test_slot_texts_too_long_are_cut_and_stay_terminated);
    RUN_TEST(test_slot_records_round_trip_and_show_free_and_damaged_places);
    RUN_TEST(test_config_status_has_its_golden_bytes);
    RUN_TEST(test_store_status_has_its_golden_bytes);
    RUN_TEST(test_serial_number_has_its_golden_bytes);
    return UNITY_END();
}
