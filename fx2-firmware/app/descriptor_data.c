/* The descriptors' bytes as they are loaded into the scratch RAM, beside the program. Not to see
 * the declaration in descriptor_data.h: what the loader writes is program to sdcc, what
 * descriptors.c reads and completes there is data. */
#include "drivers/compiler.h"
#include "link/requests.h"

#include <stdint.h>

#define DESCRIPTOR_DATA_LAYOUT_ONLY
#include "app/descriptor_data.h"

#define LOW(word)   ((uint8_t)((word)&0xFFu))
#define HIGH(word)  ((uint8_t)((word) >> 8))
#define WORD(word)  LOW(word), HIGH(word)
#define WIDE(c)     (c), 0
#define VERSION_2_0 WORD(0x0200)
#define VERSION_2_1 WORD(0x0210) /* USB 2.0 with a BOS descriptor */

enum {
    CLASS_PER_INTERFACE = 0x00,
    CLASS_VENDOR = 0xFF,
    BULK = 2,
    EP0_PACKET = 64,
    SELF_POWERED = 0xC0,
    LANGUAGE_ENGLISH_US = 0x0409,
    CAPABILITY_EXTENSION = 2,
    CAPABILITY_PLATFORM = 5
};

/* Microsoft OS 2.0 descriptors. */
enum {
    MS_SET_HEADER = 0,
    MS_COMPATIBLE_ID = 3,
    MS_REGISTRY_PROPERTY = 4,
    MS_SET_HEADER_SIZE = 10,
    MS_COMPATIBLE_ID_SIZE = 20,
    MS_NAME_SIZE = 2 * 21,
    MS_GUIDS_SIZE = 2 * 40,
    MS_PROPERTY_SIZE = 10 + MS_NAME_SIZE + MS_GUIDS_SIZE,
    MS_MULTI_SZ = 7
};
#define MS_WINDOWS_8_1 0x00, 0x00, 0x03, 0x06

#define INTERFACE(setting, endpoints)                                                              \
    INTERFACE_SIZE, USB_DESCRIPTOR_INTERFACE, 0, (setting), (endpoints), CLASS_VENDOR, 0, 0, 0
#define ENDPOINT(address)                                                                          \
    ENDPOINT_SIZE, USB_DESCRIPTOR_ENDPOINT, (address), BULK, WORD(USB_BULK_PACKET_FULL_SPEED), 0

/* clang-format off */
CODE AT(0xE000) uint8_t descriptor_data[DESCRIPTOR_DATA_SIZE] = {
    /* DEVICE_AT */
    DEVICE_SIZE, USB_DESCRIPTOR_DEVICE, VERSION_2_1,
    CLASS_PER_INTERFACE, 0, 0,
    EP0_PACKET,
    WORD(USB_VENDOR_ID), WORD(USB_PRODUCT_ID), USB_BOARD_REVISION, USB_API_LEVEL,
    STRING_MANUFACTURER, STRING_PRODUCT, 0 /* serial number: none so far */,
    1 /* configuration */,

    /* QUALIFIER_AT */
    QUALIFIER_SIZE, USB_DESCRIPTOR_QUALIFIER, VERSION_2_0,
    CLASS_PER_INTERFACE, 0, 0,
    EP0_PACKET,
    1 /* configuration */, 0,

    /* CONFIGURATION_AT: type and packet sizes are filled in for each request */
    9, USB_DESCRIPTOR_CONFIGURATION, WORD(CONFIGURATION_SIZE),
    1, USB_CONFIGURATION_VALUE, 0, SELF_POWERED, 0 /* mA from the bus */,
    INTERFACE(USB_ALTERNATE_CONTROL, 0),
    INTERFACE(USB_ALTERNATE_SOURCE_SINK, 2), ENDPOINT(USB_BULK_OUT), ENDPOINT(USB_BULK_IN),
    INTERFACE(USB_ALTERNATE_DATA, 2), ENDPOINT(USB_BULK_OUT), ENDPOINT(USB_BULK_IN),
    INTERFACE(USB_ALTERNATE_STREAM, 1), ENDPOINT(USB_BULK_IN),

    /* BOS_AT */
    5, USB_DESCRIPTOR_BOS, WORD(BOS_SIZE), 2,
    7, USB_DESCRIPTOR_CAPABILITY, CAPABILITY_EXTENSION, 0, 0, 0, 0, /* no LPM */
    28, USB_DESCRIPTOR_CAPABILITY, CAPABILITY_PLATFORM, 0,
    /* D8DD60DF-4589-4CC7-9CD2-659D9E648A9F: Microsoft OS 2.0 */
    0xDF, 0x60, 0xDD, 0xD8, 0x89, 0x45, 0xC7, 0x4C, 0x9C, 0xD2, 0x65, 0x9D, 0x9E, 0x64, 0x8A, 0x9F,
    MS_WINDOWS_8_1, WORD(MICROSOFT_SIZE), REQUEST_MICROSOFT, 0,

    /* LANGUAGES_AT */
    4, USB_DESCRIPTOR_STRING, WORD(LANGUAGE_ENGLISH_US),

    /* MANUFACTURER_AT */
    MANUFACTURER_SIZE, USB_DESCRIPTOR_STRING,
    WIDE('S'), WIDE('t'), WIDE('e'), WIDE('r'), WIDE('e'), WIDE('o'), WIDE('S'), WIDE('o'), WIDE('t'),

    /* PRODUCT_AT */
    PRODUCT_SIZE, USB_DESCRIPTOR_STRING,
    WIDE('S'), WIDE('t'), WIDE('e'), WIDE('r'), WIDE('e'), WIDE('o'), WIDE('S'), WIDE('o'), WIDE('t'),
    WIDE(' '), WIDE('t'), WIDE('u'), WIDE('r'), WIDE('r'), WIDE('e'), WIDE('t'),

    /* SERIAL_AT: its characters are filled in by descriptors_init() */
    SERIAL_SIZE, USB_DESCRIPTOR_STRING,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,

    /* MICROSOFT_AT: WinUSB, and the name by which programs find the device */
    WORD(MS_SET_HEADER_SIZE), WORD(MS_SET_HEADER), MS_WINDOWS_8_1, WORD(MICROSOFT_SIZE),
    WORD(MS_COMPATIBLE_ID_SIZE), WORD(MS_COMPATIBLE_ID),
    'W', 'I', 'N', 'U', 'S', 'B', 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    WORD(MS_PROPERTY_SIZE), WORD(MS_REGISTRY_PROPERTY), WORD(MS_MULTI_SZ), WORD(MS_NAME_SIZE),
    WIDE('D'), WIDE('e'), WIDE('v'), WIDE('i'), WIDE('c'), WIDE('e'), WIDE('I'), WIDE('n'), WIDE('t'),
    WIDE('e'), WIDE('r'), WIDE('f'), WIDE('a'), WIDE('c'), WIDE('e'), WIDE('G'), WIDE('U'), WIDE('I'),
    WIDE('D'), WIDE('s'), WIDE(0),
    WORD(MS_GUIDS_SIZE),
    WIDE('{'), WIDE('8'), WIDE('E'), WIDE('5'), WIDE('A'), WIDE('6'), WIDE('E'), WIDE('3'), WIDE('C'),
    WIDE('-'), WIDE('6'), WIDE('B'), WIDE('0'), WIDE('F'), WIDE('-'), WIDE('4'), WIDE('C'), WIDE('1'),
    WIDE('B'), WIDE('-'), WIDE('9'), WIDE('D'), WIDE('0'), WIDE('B'), WIDE('-'), WIDE('2'), WIDE('A'),
    WIDE('3'), WIDE('F'), WIDE('0'), WIDE('C'), WIDE('5'), WIDE('B'), WIDE('7'), WIDE('E'), WIDE('4'),
    WIDE('1'), WIDE('}'), WIDE(0), WIDE(0)
};
/* clang-format on */
