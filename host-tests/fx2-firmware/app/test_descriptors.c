// sources: fx2-firmware/app/descriptors.c
// includes: fx2-firmware
#include "app/descriptors.h"
#include "link/requests.h"

#include <stddef.h>
#include <unity.h>

void setUp(void) {}

void tearDown(void) {}

static uint16_t word(const uint8_t *at)
{
    return (uint16_t)(at[0] | at[1] << 8);
}

static const uint8_t *find(uint8_t type, uint8_t index)
{
    const uint8_t *descriptor = descriptor_find(type, index, 1);

    TEST_ASSERT_NOT_NULL(descriptor);
    TEST_ASSERT_EQUAL(type, descriptor[1]);
    return descriptor;
}

static void test_the_device_names_itself_and_its_api_level(void)
{
    const uint8_t *device = find(USB_DESCRIPTOR_DEVICE, 0);

    TEST_ASSERT_EQUAL(18, device[0]);
    TEST_ASSERT_EQUAL_HEX16(0x0200, word(device + 2));
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
    TEST_ASSERT_EQUAL_MEMORY(device + 2, qualifier + 2, 6);
    TEST_ASSERT_EQUAL(device[17], qualifier[8]);
    TEST_ASSERT_EQUAL(0, qualifier[9]);
}

static void check_configuration(uint8_t type, uint8_t high_speed, uint16_t packet)
{
    const uint8_t *all = descriptor_find(type, 0, high_speed);
    uint16_t total = word(all + 2);
    uint16_t at = 0;
    int interfaces = 0;
    int endpoints = 0;
    int announced = 0;

    TEST_ASSERT_EQUAL(9, all[0]);
    TEST_ASSERT_EQUAL(type, all[1]);
    TEST_ASSERT_EQUAL(total, descriptor_length(all));
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
    TEST_ASSERT_EQUAL(2, endpoints);
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

static void test_nothing_else_exists(void)
{
    int exist = 0;

    for (int type = 0; type < 256; type++) {
        for (int index = 0; index < 256; index++)
            exist += descriptor_find((uint8_t)type, (uint8_t)index, 0) != NULL;
    }
    TEST_ASSERT_EQUAL(4 + 3, exist);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_device_names_itself_and_its_api_level);
    RUN_TEST(test_the_qualifier_repeats_the_device);
    RUN_TEST(test_the_configuration_adds_up_at_both_speeds);
    RUN_TEST(test_the_other_speed_is_the_other_speed);
    RUN_TEST(test_the_strings_that_the_device_names_exist);
    RUN_TEST(test_nothing_else_exists);
    return UNITY_END();
}
