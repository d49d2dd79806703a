// sources: fx2-firmware/app/descriptors.c fx2-firmware/app/descriptor_data.c
// includes: fx2-firmware
#include "app/descriptors.h"
#include "app/eeprom.h"
#include "app/slot_store.h"
#include "drivers/usb.h"
#include "link/crc.h"
#include "link/eeprom.h"
#include "link/requests.h"

#include <stddef.h>
#include <string.h>
#include <unity.h>

uint8_t usb_control_data[USB_PACKET_EP0];

/* What the EEPROM holds where the serial number is; whether it answers. */
static uint8_t serial[EEPROM_SERIAL_SIZE];
static int eeprom_answers;
static int high_speed;

uint8_t eeprom_read(uint16_t address, uint8_t length)
{
    TEST_ASSERT_EQUAL_HEX16(EEPROM_SERIAL_AT, address);
    TEST_ASSERT_EQUAL(EEPROM_SERIAL_SIZE, length);
    memcpy(eeprom_data, serial, sizeof serial);
    return (uint8_t)eeprom_answers;
}

uint8_t usb_is_high_speed(void)
{
    return high_speed ? 0x80 : 0;
}

uint16_t slot_store_crc(const uint8_t *data, uint8_t length)
{
    return crc16_ccitt(CRC16_INIT, data, length);
}

void setUp(void)
{
    memset(serial, 0xFF, sizeof serial);
    eeprom_answers = 1;
    high_speed = 1;
    descriptors_init();
}

void tearDown(void) {}

static uint16_t word(const uint8_t *at)
{
    return (uint16_t)(at[0] | at[1] << 8);
}

static const uint8_t *find(uint8_t type, uint8_t index)
{
    const uint8_t *descriptor = descriptor_find(type, index);

    TEST_ASSERT_NOT_NULL(descriptor);
    TEST_ASSERT_EQUAL(type, descriptor[1]);
    return descriptor;
}

static void test_the_device_names_itself_and_its_api_level(void)
{
    const uint8_t *device = find(USB_DESCRIPTOR_DEVICE, 0);

    TEST_ASSERT_EQUAL(18, device[0]);
    TEST_ASSERT_EQUAL_HEX16(0x0210, word(device + 2));
    TEST_ASSERT_EQUAL(64, device[7]);
    TEST_ASSERT_EQUAL_HEX16(USB_VENDOR_ID, word(device + 8));
    TEST_ASSERT_EQUAL_HEX16(USB_PRODUCT_ID, word(device + 10));
    TEST_ASSERT_EQUAL_HEX16(USB_API_LEVEL << 8 | USB_BOARD_REVISION, word(device + 12));
    TEST_ASSERT_EQUAL(1, device[17]);
}

static void test_the_qualifier_repeats_the_device(void)
{
    const uint8_t *device = find(USB_DESCRIPTOR_DEVICE, 0);
    const uint8_t *qualifier = find(USB_DESCRIPTOR_QUALIFIER, 0);

    TEST_ASSERT_EQUAL(10, qualifier[0]);
    TEST_ASSERT_EQUAL_HEX16(0x0200, word(qualifier + 2)); /* a BOS descriptor it does not have */
    TEST_ASSERT_EQUAL_MEMORY(device + 4, qualifier + 4, 4);
    TEST_ASSERT_EQUAL(device[17], qualifier[8]);
    TEST_ASSERT_EQUAL(0, qualifier[9]);
}

static void check_configuration(uint8_t type, int at_high_speed, uint16_t packet)
{
    const uint8_t *all = (high_speed = at_high_speed, descriptor_find(type, 0));
    uint16_t total = word(all + 2);
    uint16_t at = 0;
    int interfaces = 0;
    int endpoints = 0;
    int announced = 0;

    TEST_ASSERT_EQUAL(9, all[0]);
    TEST_ASSERT_EQUAL(type, all[1]);
    TEST_ASSERT_EQUAL(total, descriptor_length);
    TEST_ASSERT_EQUAL(USB_CONFIGURATION_VALUE, all[5]);
    TEST_ASSERT_EQUAL_HEX8(0xC0, all[7]); /* self-powered, as bit 7 demands */
    while (at < total) {
        const uint8_t *one = all + at;

        TEST_ASSERT_GREATER_OR_EQUAL(2, one[0]);
        if (one[1] == USB_DESCRIPTOR_INTERFACE) {
            TEST_ASSERT_EQUAL(announced, endpoints);
            announced += one[4];
            interfaces += one[3] == 0;
        } else if (one[1] == USB_DESCRIPTOR_ENDPOINT) {
            endpoints++;
            TEST_ASSERT_EQUAL(2, one[3]); /* bulk */
            TEST_ASSERT_EQUAL(packet, word(one + 4));
        }
        at = (uint16_t)(at + one[0]);
    }
    TEST_ASSERT_EQUAL(total, at);
    TEST_ASSERT_EQUAL(all[4], interfaces);
    TEST_ASSERT_EQUAL(announced, endpoints);
    TEST_ASSERT_EQUAL(5, endpoints);
}

static void test_the_configuration_adds_up_at_both_speeds(void)
{
    check_configuration(USB_DESCRIPTOR_CONFIGURATION, 1, 512);
    check_configuration(USB_DESCRIPTOR_CONFIGURATION, 0, 64);
}

static void test_the_other_speed_is_the_other_speed(void)
{
    check_configuration(USB_DESCRIPTOR_OTHER_SPEED, 1, 64);
    check_configuration(USB_DESCRIPTOR_OTHER_SPEED, 0, 512);
}

static void check_string(uint8_t index, const char *text)
{
    const uint8_t *string = find(USB_DESCRIPTOR_STRING, index);
    uint8_t i;

    for (i = 0; text[i] != '\0'; i++)
        TEST_ASSERT_EQUAL_HEX16(text[i], word(string + 2 + 2 * i));
    TEST_ASSERT_EQUAL(2 + 2 * i, string[0]);
}

static void test_the_strings_that_the_device_names_exist(void)
{
    const uint8_t *device = find(USB_DESCRIPTOR_DEVICE, 0);

    TEST_ASSERT_EQUAL_HEX16(0x0409, word(find(USB_DESCRIPTOR_STRING, 0) + 2));
    check_string(device[14], "StereoSot");
    check_string(device[15], "StereoSot turret");
    TEST_ASSERT_EQUAL(0, device[16]);
}

static void test_the_serial_number_is_that_of_the_eeprom(void)
{
    eeprom_serial_encode("SOT000000042", serial);
    descriptors_init();
    TEST_ASSERT_EQUAL(3, find(USB_DESCRIPTOR_DEVICE, 0)[16]);
    check_string(3, "SOT000000042");
    find(USB_DESCRIPTOR_DEVICE, 0);
}

static void test_a_damaged_or_absent_serial_number_is_none(void)
{
    eeprom_serial_encode("SOT000000042", serial);
    serial[5] ^= 1;
    descriptors_init();
    TEST_ASSERT_NULL(descriptor_find(USB_DESCRIPTOR_STRING, 3));
    serial[5] ^= 1;
    eeprom_answers = 0;
    descriptors_init();
    TEST_ASSERT_NULL(descriptor_find(USB_DESCRIPTOR_STRING, 3));
}

static void test_the_bos_descriptor_announces_what_windows_asks_for(void)
{
    static const uint8_t platform[16] = {0xDF, 0x60, 0xDD, 0xD8, 0x89, 0x45, 0xC7, 0x4C,
                                         0x9C, 0xD2, 0x65, 0x9D, 0x9E, 0x64, 0x8A, 0x9F};
    const uint8_t *bos = find(USB_DESCRIPTOR_BOS, 0);
    uint16_t total = word(bos + 2);
    uint16_t at = 5;
    int capabilities = 0;

    TEST_ASSERT_EQUAL(total, descriptor_length);
    while (at < total) {
        const uint8_t *one = bos + at;

        TEST_ASSERT_EQUAL(USB_DESCRIPTOR_CAPABILITY, one[1]);
        if (one[2] == 5) {
            TEST_ASSERT_EQUAL_MEMORY(platform, one + 4, 16);
            descriptor_microsoft();
            TEST_ASSERT_EQUAL(descriptor_length, word(one + 24));
            TEST_ASSERT_EQUAL_HEX8(REQUEST_MICROSOFT, one[26]);
        }
        capabilities++;
        at = (uint16_t)(at + one[0]);
    }
    TEST_ASSERT_EQUAL(total, at);
    TEST_ASSERT_EQUAL(bos[4], capabilities);
}

/* Lengths nest: the set, in it the compatible ID and the registry property, in it name and data. */
static void test_the_microsoft_set_adds_up(void)
{
    const uint8_t *set = descriptor_microsoft();
    const uint8_t *property = set + 10 + 20;
    uint16_t name = word(property + 6);
    uint16_t data = word(property + 8 + name);

    TEST_ASSERT_EQUAL(10, word(set));
    TEST_ASSERT_EQUAL(descriptor_length, word(set + 8));
    TEST_ASSERT_EQUAL(20, word(set + 10));
    TEST_ASSERT_EQUAL(3, word(set + 12));
    TEST_ASSERT_EQUAL_STRING("WINUSB", (const char *)set + 14);
    TEST_ASSERT_EQUAL(descriptor_length - 30, word(property));
    TEST_ASSERT_EQUAL(4, word(property + 2));
    TEST_ASSERT_EQUAL(descriptor_length - 30, 8 + name + 2 + data);
    TEST_ASSERT_EQUAL('D', property[8]);
    TEST_ASSERT_EQUAL('{', property[10 + name]);
    TEST_ASSERT_EQUAL('}', property[10 + name + data - 6]);
}

static void test_nothing_else_exists(void)
{
    int exist = 0;

    for (int type = 0; type < 256; type++) {
        for (int index = 0; index < 256; index++)
            exist += descriptor_find((uint8_t)type, (uint8_t)index) != NULL;
    }
    /* device, qualifier, two configurations, BOS, three strings */
    TEST_ASSERT_EQUAL(5 + 3, exist);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_device_names_itself_and_its_api_level);
    RUN_TEST(test_the_qualifier_repeats_the_device);
    RUN_TEST(test_the_configuration_adds_up_at_both_speeds);
    RUN_TEST(test_the_other_speed_is_the_other_speed);
    RUN_TEST(test_the_strings_that_the_device_names_exist);
    RUN_TEST(test_the_serial_number_is_that_of_the_eeprom);
    RUN_TEST(test_a_damaged_or_absent_serial_number_is_none);
    RUN_TEST(test_the_bos_descriptor_announces_what_windows_asks_for);
    RUN_TEST(test_the_microsoft_set_adds_up);
    RUN_TEST(test_nothing_else_exists);
    return UNITY_END();
}
