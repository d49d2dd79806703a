/* The loader's frames and the images' headers, held against the golden bytes of docs/SPEC.md. */
#include <string.h>
#include <unity.h>

#include "link/base_image.h"
#include "link/crc.h"
#include "link/loader.h"

/* Static: an 8051 has little stack. */
static loader_receiver_t receiver;
static uint8_t wire[LOADER_WIRE_MAX];
static uint8_t payload[LOADER_PAYLOAD_MAX];
static uint16_t got_size;

void setUp(void)
{
    loader_receiver_init(&receiver);
}

void tearDown(void) {}

/* Feeds the characters; returns how many of them ended a good frame. */
static uint8_t feed(const uint8_t *characters, uint16_t count)
{
    uint8_t frames = 0;

    while (count--)
        frames = (uint8_t)(frames + loader_receive(&receiver, *characters++, &got_size));
    return frames;
}

static const uint8_t golden_erase[8] = {0x00, 0x06, 0x03, 0x2A, 0x02, 0x5C, 0xA3, 0x00};

static void test_a_frame_has_its_golden_bytes(void)
{
    static const uint8_t sector = 2;

    TEST_ASSERT_EQUAL_UINT16(sizeof golden_erase,
                             loader_frame_encode(LOADER_ERASE, 0x2A, &sector, 1, wire));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden_erase, wire, sizeof golden_erase);
    TEST_ASSERT_EQUAL_UINT8(1, feed(golden_erase, sizeof golden_erase));
    TEST_ASSERT_EQUAL_HEX8(LOADER_ERASE, receiver.frame[0]);
    TEST_ASSERT_EQUAL_HEX8(0x2A, receiver.frame[1]);
    TEST_ASSERT_EQUAL_HEX8(2, receiver.frame[2]);
    TEST_ASSERT_EQUAL_UINT16(1, got_size);
}

static void check_round_trip(uint16_t size)
{
    uint16_t count = loader_frame_encode(LOADER_WRITE, 7, payload, size, wire);
    uint16_t i;

    TEST_ASSERT_TRUE(count <= LOADER_WIRE_MAX);
    for (i = 1; i + 1u < count; i++)
        TEST_ASSERT_NOT_EQUAL(0, wire[i]);
    TEST_ASSERT_EQUAL_UINT8(1, feed(wire, count));
    TEST_ASSERT_EQUAL_UINT16(size, got_size);
    if (size > 0)
        TEST_ASSERT_EQUAL_HEX8_ARRAY(payload, receiver.frame + 2, size);
}

static void test_any_payload_comes_through(void)
{
    static const uint16_t sizes[8] = {0, 1, 2, 251, 252, 253, 254, LOADER_PAYLOAD_MAX};
    uint8_t i;
    uint16_t k;

    for (i = 0; i < 8; i++) {
        memset(payload, 0, sizeof payload);
        check_round_trip(sizes[i]);
        memset(payload, 0xFF, sizeof payload);
        check_round_trip(sizes[i]);
        for (k = 0; k < sizeof payload; k++)
            payload[k] = (uint8_t)(k * 7u);
        check_round_trip(sizes[i]);
    }
}

static void test_a_damaged_frame_is_dropped_and_the_next_one_found(void)
{
    uint8_t damaged[sizeof golden_erase];
    uint8_t i;

    for (i = 1; i + 1u < sizeof golden_erase; i++) {
        memcpy(damaged, golden_erase, sizeof damaged);
        damaged[i] ^= 0x10;
        TEST_ASSERT_EQUAL_UINT8(0, feed(damaged, sizeof damaged));
        TEST_ASSERT_EQUAL_UINT8(1, feed(golden_erase, sizeof golden_erase));
        /* A character lost. */
        TEST_ASSERT_EQUAL_UINT8(0, feed(golden_erase, i));
        TEST_ASSERT_EQUAL_UINT8(0, feed(golden_erase + i + 1, (uint16_t)(sizeof damaged - 1 - i)));
        TEST_ASSERT_EQUAL_UINT8(1, feed(golden_erase, sizeof golden_erase));
    }
}

static void test_endless_noise_overflows_nothing(void)
{
    uint16_t i;

    for (i = 0; i < 3u * LOADER_FRAME_MAX; i++) {
        uint8_t noise = (uint8_t)(1u + i % 255u);

        TEST_ASSERT_EQUAL_UINT8(0, feed(&noise, 1));
    }
    TEST_ASSERT_EQUAL_UINT8(1, feed(golden_erase, sizeof golden_erase));
}

static const uint8_t golden_image[BASE_IMAGE_HEADER_SIZE] = {
    0x42, 0x41, 0x53, 0x45, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x61, 0xF4, 0x00, 0x10, 0x28, 0x00,
    0x00, 0x10, 0x2C, 0x00, 0x01, 0x23, 0x45, 0x67, 0x00, 0x00, 0x00, 0x09, 0x00, 0x01, 0x02, 0x03,
    0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F, 0x10, 0x11, 0x12, 0x13,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x3A, 0xBC};

static void test_an_image_header_has_its_golden_bytes(void)
{
    static base_image_t image;
    static base_image_t back;
    uint8_t i;

    image.length = 25076;
    image.load = 0x102800;
    image.entry = 0x102C00;
    image.crc32 = 0x01234567;
    image.generation = 9;
    for (i = 0; i < BASE_IMAGE_BUILD_SIZE; i++)
        image.build[i] = i;
    base_image_encode(&image, wire);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden_image, wire, BASE_IMAGE_HEADER_SIZE);
    TEST_ASSERT_EQUAL_INT(BASE_IMAGE_OK, base_image_decode(golden_image, &back));
    TEST_ASSERT_EQUAL_UINT32(image.length, back.length);
    TEST_ASSERT_EQUAL_UINT32(image.load, back.load);
    TEST_ASSERT_EQUAL_UINT32(image.entry, back.entry);
    TEST_ASSERT_EQUAL_UINT32(image.crc32, back.crc32);
    TEST_ASSERT_EQUAL_UINT32(image.generation, back.generation);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(image.build, back.build, BASE_IMAGE_BUILD_SIZE);
}

static void test_a_header_with_any_byte_changed_is_none(void)
{
    static base_image_t image;
    uint8_t i;

    for (i = 0; i < BASE_IMAGE_HEADER_SIZE; i++) {
        memcpy(wire, golden_image, BASE_IMAGE_HEADER_SIZE);
        wire[i] ^= 0x40;
        TEST_ASSERT_EQUAL_INT(BASE_IMAGE_NONE, base_image_decode(wire, &image));
    }
}

static void test_the_answer_to_hello_comes_through(void)
{
    static loader_hello_t hello;
    static loader_hello_t back;

    memset(&hello, 0, sizeof hello);
    hello.protocol = LOADER_PROTOCOL;
    hello.why = LOADER_WHY_HELLO;
    hello.active = 1;
    hello.sectors = 3;
    hello.bank_size = 0x30000;
    hello.ram_first = 0x102800;
    hello.ram_end = 0x178000;
    hello.length = 25076;
    hello.crc32 = 0x89ABCDEFul;
    hello.generation = 4;
    memset(hello.build, 0x5A, sizeof hello.build);
    loader_hello_encode(&hello, wire);
    loader_hello_decode(wire, &back);
    TEST_ASSERT_EQUAL_UINT8(hello.active, back.active);
    TEST_ASSERT_EQUAL_UINT8(hello.sectors, back.sectors);
    TEST_ASSERT_EQUAL_UINT32(hello.bank_size, back.bank_size);
    TEST_ASSERT_EQUAL_UINT32(hello.ram_end, back.ram_end);
    TEST_ASSERT_EQUAL_UINT32(hello.crc32, back.crc32);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(hello.build, back.build, sizeof hello.build);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_frame_has_its_golden_bytes);
    RUN_TEST(test_any_payload_comes_through);
    RUN_TEST(test_a_damaged_frame_is_dropped_and_the_next_one_found);
    RUN_TEST(test_endless_noise_overflows_nothing);
    RUN_TEST(test_an_image_header_has_its_golden_bytes);
    RUN_TEST(test_a_header_with_any_byte_changed_is_none);
    RUN_TEST(test_the_answer_to_hello_comes_through);
    return UNITY_END();
}
