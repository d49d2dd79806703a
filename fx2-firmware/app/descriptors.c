#include "app/descriptors.h"

#include "drivers/usb_bulk.h"
#include "link/requests.h"

#include <stddef.h>

#define LOW(word)  ((uint8_t)((word)&0xFFu))
#define HIGH(word) ((uint8_t)((word) >> 8))

enum {
    DEVICE_SIZE = 18,
    QUALIFIER_SIZE = 10,
    CONFIGURATION_SIZE = 9 + 9 + 9 + 7 + 7,

    STRING_LANGUAGES = 0,
    STRING_MANUFACTURER = 1,
    STRING_PRODUCT = 2,

    CLASS_PER_INTERFACE = 0x00,
    CLASS_VENDOR = 0xFF,
    BULK = 2,
    EP0_PACKET = 64,
    SELF_POWERED = 0xC0,
    LANGUAGE_ENGLISH_US = 0x0409,

    AT_LENGTH = 0,
    AT_TYPE = 1,
    AT_TOTAL_LENGTH = 2
};

/* clang-format off */
static const CODE uint8_t device[DEVICE_SIZE] = {
    DEVICE_SIZE, USB_DESCRIPTOR_DEVICE,
    LOW(0x0200), HIGH(0x0200), /* USB 2.0 */
    CLASS_PER_INTERFACE, 0, 0,
    EP0_PACKET,
    LOW(USB_VENDOR_ID), HIGH(USB_VENDOR_ID),
    LOW(USB_PRODUCT_ID), HIGH(USB_PRODUCT_ID),
    USB_BOARD_REVISION, USB_API_LEVEL,
    STRING_MANUFACTURER, STRING_PRODUCT, 0, /* no serial number */
    1 /* configuration */
};

static const CODE uint8_t qualifier[QUALIFIER_SIZE] = {
    QUALIFIER_SIZE, USB_DESCRIPTOR_QUALIFIER,
    LOW(0x0200), HIGH(0x0200),
    CLASS_PER_INTERFACE, 0, 0,
    EP0_PACKET,
    1, /* configuration */
    0
};

/* As at full speed; build_configuration() fills in what depends on speed and type. */
static const CODE uint8_t configuration[CONFIGURATION_SIZE] = {
    9, USB_DESCRIPTOR_CONFIGURATION, LOW(CONFIGURATION_SIZE), HIGH(CONFIGURATION_SIZE),
    1, USB_CONFIGURATION_VALUE, 0, SELF_POWERED, 0 /* mA from the bus */,
    9, USB_DESCRIPTOR_INTERFACE, 0, USB_ALTERNATE_CONTROL, 0, CLASS_VENDOR, 0, 0, 0,
    9, USB_DESCRIPTOR_INTERFACE, 0, USB_ALTERNATE_SOURCE_SINK, 2, CLASS_VENDOR, 0, 0, 0,
    7, USB_DESCRIPTOR_ENDPOINT, USB_BULK_OUT, BULK,
    LOW(USB_BULK_PACKET_FULL_SPEED), HIGH(USB_BULK_PACKET_FULL_SPEED), 0,
    7, USB_DESCRIPTOR_ENDPOINT, USB_BULK_IN, BULK,
    LOW(USB_BULK_PACKET_FULL_SPEED), HIGH(USB_BULK_PACKET_FULL_SPEED), 0
};
/* Where the endpoints' wMaxPacketSize are in it. */
enum { AT_PACKET_OUT = 9 + 9 + 9 + 4, AT_PACKET_IN = AT_PACKET_OUT + 7 };

static XDATA uint8_t built[CONFIGURATION_SIZE];

static const CODE uint8_t languages[] = {
    4, USB_DESCRIPTOR_STRING, LOW(LANGUAGE_ENGLISH_US), HIGH(LANGUAGE_ENGLISH_US)
};
static const CODE uint8_t manufacturer[] = {
    2 + 2 * 9, USB_DESCRIPTOR_STRING,
    'S', 0, 't', 0, 'e', 0, 'r', 0, 'e', 0, 'o', 0, 'S', 0, 'o', 0, 't', 0
};
static const CODE uint8_t product[] = {
    2 + 2 * 16, USB_DESCRIPTOR_STRING,
    'S', 0, 't', 0, 'e', 0, 'r', 0, 'e', 0, 'o', 0, 'S', 0, 'o', 0, 't', 0, ' ', 0,
    't', 0, 'u', 0, 'r', 0, 'r', 0, 'e', 0, 't', 0
};
/* clang-format on */

/* Program memory as MOVX sees it: the same RAM at the same address (TRM, chapter 3). */
#define READABLE(constant) ((const XDATA uint8_t *)(constant))

static const XDATA uint8_t *find_string(uint8_t index)
{
    switch (index) {
    case STRING_LANGUAGES:
        return READABLE(languages);
    case STRING_MANUFACTURER:
        return READABLE(manufacturer);
    case STRING_PRODUCT:
        return READABLE(product);
    default:
        return NULL;
    }
}

static void set_packet_size(uint8_t at)
{
    built[at] = LOW(USB_BULK_PACKET_HIGH_SPEED);
    built[at + 1] = HIGH(USB_BULK_PACKET_HIGH_SPEED);
}

static const XDATA uint8_t *build_configuration(uint8_t type, uint8_t high_speed)
{
    uint8_t i;

    for (i = 0; i < CONFIGURATION_SIZE; i++)
        built[i] = configuration[i];
    built[AT_TYPE] = type;
    if (high_speed) {
        set_packet_size(AT_PACKET_OUT);
        set_packet_size(AT_PACKET_IN);
    }
    return built;
}

const XDATA uint8_t *descriptor_find(uint8_t type, uint8_t index, uint8_t high_speed)
{
    if (type == USB_DESCRIPTOR_STRING)
        return find_string(index);
    if (index != 0)
        return NULL;
    switch (type) {
    case USB_DESCRIPTOR_DEVICE:
        return READABLE(device);
    case USB_DESCRIPTOR_CONFIGURATION:
        return build_configuration(type, high_speed);
    case USB_DESCRIPTOR_QUALIFIER:
        return READABLE(qualifier);
    case USB_DESCRIPTOR_OTHER_SPEED:
        return build_configuration(type, !high_speed);
    default:
        return NULL;
    }
}

uint8_t descriptor_length(const XDATA uint8_t *descriptor)
{
    uint8_t type = descriptor[AT_TYPE];

    if (type == USB_DESCRIPTOR_CONFIGURATION || type == USB_DESCRIPTOR_OTHER_SPEED)
        return descriptor[AT_TOTAL_LENGTH];
    return descriptor[AT_LENGTH];
}
