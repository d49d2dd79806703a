// sources: fx2-firmware/eeprom-loader/loader.c fx2-firmware/eeprom-loader/writer.c
// sources: host-tests/fx2-firmware/fakes/fake_usb.c host-tests/fx2-firmware/fakes/fake_clock.c
// includes: fx2-firmware
/* The EEPROM loader against an EEPROM of bytes: its requests, and what a cut leaves. */
#define I2C_BYTES 66u /* as the loader is built */
#include "board/turret.h"
#include "drivers/i2c.h"
#include "eeprom-loader/loader.h"
#include "host-tests/fx2-firmware/fakes/fake_clock.h"
#include "host-tests/fx2-firmware/fakes/fake_usb.h"
#include "link/crc.h"
#include "link/eeprom.h"

#include <string.h>
#include <unity.h>

#define IMAGE_LENGTH 1000u

/* ---- the EEPROM ---- */

static uint8_t memory[TURRET_EEPROM_SIZE];
static uint16_t pointer;
static int present;
static int worn_at;  /* this byte does not change; -1 */
static int busy_for; /* polls without acknowledge after a write */
static int busy;
static long writes;
static long cut_at;   /* from this write on nothing changes any more; -1 */
static int cut_bytes; /* of that write, so many bytes are still written */

uint8_t i2c_bytes[I2C_BYTES];

void i2c_init(void) {}

uint8_t i2c_write(uint8_t address, uint8_t count)
{
    int bytes = count - 2;

    if (!present || address != TURRET_EEPROM_ADDRESS)
        return I2C_NO_ACK;
    if (busy > 0) {
        busy--;
        return I2C_NO_ACK;
    }
    if (count < 2)
        return I2C_OK;
    pointer = (uint16_t)((unsigned)(i2c_bytes[0] << 8 | i2c_bytes[1]) % TURRET_EEPROM_SIZE);
    if (bytes == 0)
        return I2C_OK;
    TEST_ASSERT_TRUE(pointer % (int)EEPROM_PAGE + bytes <= (int)EEPROM_PAGE);
    if (cut_at >= 0 && writes > cut_at)
        bytes = 0;
    if (writes == cut_at && cut_bytes < bytes)
        bytes = cut_bytes;
    writes++;
    busy = busy_for;
    for (int i = 0; i < bytes; i++) {
        if (pointer + i != worn_at)
            memory[pointer + i] = i2c_bytes[2 + i];
    }
    return I2C_OK;
}

uint8_t i2c_read(uint8_t address)
{
    if (!present || busy > 0 || address != TURRET_EEPROM_ADDRESS)
        return I2C_NO_ACK;
    i2c_bytes[0] = memory[pointer];
    pointer = (uint16_t)((pointer + 1) % TURRET_EEPROM_SIZE);
    return I2C_OK;
}

/* ---- the host ---- */

static uint8_t image[IMAGE_LENGTH];
static uint8_t old_image[IMAGE_LENGTH];

static void request(uint8_t type, uint8_t number, uint16_t value, uint16_t index, uint16_t length)
{
    fake_usb_setup(type, number, value, index, length);
    loader_poll();
}

static uint8_t result(void)
{
    request(0xC0, REQUEST_LOADER_STATUS, 0, 0, LOADER_STATUS_SIZE);
    TEST_ASSERT_EQUAL(LOADER_STATUS_SIZE, fake_usb_answer.length);
    TEST_ASSERT_EQUAL(LOADER_VERSION, fake_usb_answer.data[0]);
    return fake_usb_answer.data[1];
}

/* 1 if the request was acknowledged. */
static int command(uint8_t number, uint16_t value, uint16_t index)
{
    request(0x40, number, value, index, 0);
    TEST_ASSERT_EQUAL(1, fake_usb_answers());
    return fake_usb_answer.acknowledged;
}

static int put(uint16_t at, const uint8_t *data, uint16_t length)
{
    request(0x40, REQUEST_LOADER_WRITE, at, 0, length);
    if (fake_usb_answers() == 0) {
        fake_usb_data(data, length);
        loader_poll();
    }
    TEST_ASSERT_EQUAL(1, fake_usb_answers());
    return fake_usb_answer.acknowledged;
}

static uint16_t image_crc(void)
{
    return crc16_ccitt(CRC16_INIT, image, IMAGE_LENGTH);
}

/* As a host does it, stopping at the first refusal. */
static int write_image(void)
{
    if (!command(REQUEST_LOADER_BEGIN, 0, 0))
        return 0;
    for (uint16_t at = 0; at < IMAGE_LENGTH; at = (uint16_t)(at + EEPROM_PAGE)) {
        uint16_t left = (uint16_t)(IMAGE_LENGTH - at);

        if (!put(at, image + at, left < EEPROM_PAGE ? left : EEPROM_PAGE))
            return 0;
    }
    return command(REQUEST_LOADER_COMMIT, IMAGE_LENGTH, image_crc());
}

void setUp(void)
{
    for (unsigned i = 0; i < IMAGE_LENGTH; i++) {
        image[i] = (uint8_t)(i * 5u);
        old_image[i] = (uint8_t)(i * 3u + 1u);
    }
    image[0] = EEPROM_BOOT;
    old_image[0] = EEPROM_BOOT;
    memset(memory, 0xFF, sizeof memory);
    memcpy(memory, old_image, IMAGE_LENGTH);
    present = 1;
    worn_at = -1;
    busy = 0;
    busy_for = 3;
    writes = 0;
    cut_at = -1;
}

void tearDown(void)
{
    /* Out of any BEGIN: a commit that fits. */
    cut_at = -1;
    present = 1;
    worn_at = -1;
    busy = busy_for = 0;
    write_image();
}

static void test_an_image_is_written_and_committed(void)
{
    TEST_ASSERT_TRUE(write_image());
    TEST_ASSERT_EQUAL_MEMORY(image, memory, IMAGE_LENGTH);
    TEST_ASSERT_EQUAL(LOADER_OK, result());
}

/* Byte 0 decides what the chip starts from: FF = nothing, C2 = the image behind it. */
static void test_a_cut_at_any_byte_leaves_a_blank_chip_or_a_whole_image(void)
{
    long last;

    TEST_ASSERT_TRUE(write_image());
    last = writes;
    for (long at = 0; at < last; at++) {
        for (int bytes = 0; bytes <= (int)EEPROM_PAGE; bytes += 13) {
            setUp();
            cut_at = at;
            cut_bytes = bytes;
            write_image();
            if (memory[0] == EEPROM_BOOT)
                TEST_ASSERT_TRUE(memcmp(memory, image, IMAGE_LENGTH) == 0 ||
                                 memcmp(memory, old_image, IMAGE_LENGTH) == 0);
            else
                TEST_ASSERT_EQUAL_HEX8(EEPROM_BLANK, memory[0]);
        }
    }
}

static void test_byte_0_stays_blank_until_the_commit(void)
{
    TEST_ASSERT_TRUE(command(REQUEST_LOADER_BEGIN, 0, 0));
    TEST_ASSERT_EQUAL_HEX8(EEPROM_BLANK, memory[0]);
    TEST_ASSERT_TRUE(put(0, image, EEPROM_PAGE));
    TEST_ASSERT_EQUAL_HEX8(EEPROM_BLANK, memory[0]);
    TEST_ASSERT_EQUAL_MEMORY(image + 1, memory + 1, EEPROM_PAGE - 1);
}

static void test_a_commit_of_something_else_is_refused(void)
{
    command(REQUEST_LOADER_BEGIN, 0, 0);
    put(0, image, EEPROM_PAGE);
    TEST_ASSERT_FALSE(command(REQUEST_LOADER_COMMIT, IMAGE_LENGTH, image_crc()));
    TEST_ASSERT_EQUAL(LOADER_BAD_CRC, result());
    TEST_ASSERT_EQUAL_HEX8(EEPROM_BLANK, memory[0]);
}

static void test_nothing_is_written_before_begin_but_the_serial_number(void)
{
    uint8_t serial[EEPROM_SERIAL_SIZE];

    TEST_ASSERT_FALSE(put(64, image, 10));
    TEST_ASSERT_EQUAL(LOADER_NOT_BEGUN, result());
    TEST_ASSERT_FALSE(command(REQUEST_LOADER_COMMIT, IMAGE_LENGTH, image_crc()));
    TEST_ASSERT_EQUAL(LOADER_NOT_BEGUN, result());
    TEST_ASSERT_EQUAL(0, writes);
    eeprom_serial_encode("SOT000000042", serial);
    TEST_ASSERT_TRUE(put(EEPROM_SERIAL_AT, serial, EEPROM_SERIAL_SIZE));
    TEST_ASSERT_EQUAL_MEMORY(serial, memory + EEPROM_SERIAL_AT, EEPROM_SERIAL_SIZE);
}

static void test_ill_formed_requests_are_refused(void)
{
    command(REQUEST_LOADER_BEGIN, 0, 0);
    TEST_ASSERT_FALSE(put(63, image, 2));
    TEST_ASSERT_FALSE(put(0, image, 65));
    TEST_ASSERT_FALSE(put(TURRET_EEPROM_SIZE, image, 1));
    TEST_ASSERT_FALSE(command(REQUEST_LOADER_WRITE, 0, 0));
    TEST_ASSERT_FALSE(command(REQUEST_LOADER_COMMIT, 0, 0));
    TEST_ASSERT_FALSE(command(REQUEST_LOADER_COMMIT, EEPROM_SERIAL_AT + 1, 0));
    TEST_ASSERT_EQUAL(LOADER_REFUSED, result());
    request(0xC0, REQUEST_LOADER_READ, 0, 0, 65);
    TEST_ASSERT_EQUAL(1, fake_usb_answer.stalled);
    request(0x80, 6, 0x0100, 0, 18);
    TEST_ASSERT_EQUAL(1, fake_usb_answer.stalled);
}

static void test_what_is_stored_can_be_read(void)
{
    request(0xC0, REQUEST_LOADER_READ, 100, 0, 64);
    TEST_ASSERT_EQUAL(64, fake_usb_answer.length);
    TEST_ASSERT_EQUAL_MEMORY(old_image + 100, fake_usb_answer.data, 64);
}

static void test_a_missing_a_slow_and_a_worn_eeprom_are_told_apart(void)
{
    present = 0;
    TEST_ASSERT_FALSE(command(REQUEST_LOADER_BEGIN, 0, 0));
    TEST_ASSERT_EQUAL(LOADER_NO_EEPROM, result());
    present = 1;
    busy_for = 1 << 30;
    TEST_ASSERT_FALSE(command(REQUEST_LOADER_BEGIN, 0, 0));
    TEST_ASSERT_EQUAL(LOADER_TIMEOUT, result());
    busy = busy_for = 0;
    worn_at = 130;
    TEST_ASSERT_FALSE(write_image());
    TEST_ASSERT_EQUAL(LOADER_DIFFERS, result());
    TEST_ASSERT_EQUAL_HEX8(EEPROM_BLANK, memory[0]);
}

static void test_a_bus_reset_gives_usb_back(void)
{
    fake_usb_bus_reset();
    TEST_ASSERT_TRUE(loader_poll());
    TEST_ASSERT_FALSE(loader_poll());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_image_is_written_and_committed);
    RUN_TEST(test_a_cut_at_any_byte_leaves_a_blank_chip_or_a_whole_image);
    RUN_TEST(test_byte_0_stays_blank_until_the_commit);
    RUN_TEST(test_a_commit_of_something_else_is_refused);
    RUN_TEST(test_nothing_is_written_before_begin_but_the_serial_number);
    RUN_TEST(test_ill_formed_requests_are_refused);
    RUN_TEST(test_what_is_stored_can_be_read);
    RUN_TEST(test_a_missing_a_slow_and_a_worn_eeprom_are_told_apart);
    RUN_TEST(test_a_bus_reset_gives_usb_back);
    return UNITY_END();
}
