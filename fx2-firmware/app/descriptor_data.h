/* Where the descriptors lie in the scratch RAM. The loader puts them there with the program; code
 * has no other home for them in 8 KB. */
#ifndef APP_DESCRIPTOR_DATA_H
#define APP_DESCRIPTOR_DATA_H

#include "app/descriptors.h"
#include "drivers/compiler.h"
#include "drivers/usb_bulk.h"

#include <stdint.h>

enum {
    DEVICE_SIZE = 18,
    QUALIFIER_SIZE = 10,
    INTERFACE_SIZE = 9,
    ENDPOINT_SIZE = 7,
    CONFIGURATION_SIZE = 9 + 4 * INTERFACE_SIZE + 5 * ENDPOINT_SIZE,
    BOS_SIZE = 5 + 7 + 28,
    LANGUAGES_SIZE = 4,
    MANUFACTURER_SIZE = 2 + 2 * 9,
    PRODUCT_SIZE = 2 + 2 * 16,
    SERIAL_SIZE = 2 + 2 * 12,
    MICROSOFT_SIZE = 162,

    DEVICE_AT = 0,
    QUALIFIER_AT = DEVICE_AT + DEVICE_SIZE,
    CONFIGURATION_AT = QUALIFIER_AT + QUALIFIER_SIZE,
    BOS_AT = CONFIGURATION_AT + CONFIGURATION_SIZE,
    LANGUAGES_AT = BOS_AT + BOS_SIZE,
    MANUFACTURER_AT = LANGUAGES_AT + LANGUAGES_SIZE,
    PRODUCT_AT = MANUFACTURER_AT + MANUFACTURER_SIZE,
    SERIAL_AT = PRODUCT_AT + PRODUCT_SIZE,
    MICROSOFT_AT = SERIAL_AT + SERIAL_SIZE,
    DESCRIPTOR_DATA_SIZE = MICROSOFT_AT + MICROSOFT_SIZE,

    STRING_MANUFACTURER = 1,
    STRING_PRODUCT = 2,
    STRING_SERIAL = 3
};

#ifndef DESCRIPTOR_DATA_LAYOUT_ONLY
extern XDATA AT(0xE000) uint8_t descriptor_data[DESCRIPTOR_DATA_SIZE];
#endif

#endif
