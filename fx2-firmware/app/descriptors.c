#include "app/descriptors.h"

#include "app/descriptor_data.h"
#include "app/eeprom.h"
#include "app/slot_store.h"
#include "drivers/usb.h"
#include "link/eeprom.h"

#include <stddef.h>

enum {
    AT_LENGTH = 0,
    AT_TYPE = 1,
    AT_TOTAL_LENGTH = 2, /* of what holds others */
    AT_PACKET_SIZE = 4,  /* of an endpoint */
    AT_SERIAL = 16       /* of the device */
};

#define CONFIGURATION (descriptor_data + CONFIGURATION_AT)

uint8_t descriptor_length;
static const XDATA uint8_t *XDATA end; /* of those that there are */

void descriptors_init(void)
{
    const XDATA uint8_t *from = eeprom_data + EEPROM_SERIAL_TEXT_AT;
    XDATA uint8_t *to = descriptor_data + SERIAL_AT + 2;
    uint8_t left;

    end = descriptor_data + SERIAL_AT;
    if (!eeprom_read(EEPROM_SERIAL_AT, EEPROM_SERIAL_SIZE) || eeprom_data[0] != 'S' ||
        slot_store_crc(eeprom_data, EEPROM_SERIAL_SIZE) != 0)
        return;
    left = EEPROM_SERIAL_TEXT;
    do {
        *to++ = *from++;
        to++;
    } while (--left);
    end = descriptor_data + MICROSOFT_AT;
    descriptor_data[DEVICE_AT + AT_SERIAL] = STRING_SERIAL;
}

/* The configuration as it reads at the other speed, or at this one. */
ONCE void set_packet_sizes(uint8_t other)
{
    XDATA uint8_t *at = CONFIGURATION;
    uint8_t low = USB_BULK_PACKET_FULL_SPEED;
    uint8_t high = 0;

    if (usb_is_high_speed())
        other = !other;
    if (other) {
        low = 0;
        high = USB_BULK_PACKET_HIGH_SPEED >> 8;
    }
    do {
        uint8_t size = *at;

        if (size == ENDPOINT_SIZE) {
            at[AT_PACKET_SIZE] = low;
            at[AT_PACKET_SIZE + 1] = high;
        }
        at += size;
    } while (at != CONFIGURATION + CONFIGURATION_SIZE);
}

/* Descriptors follow one upon the other, strings in the order of their indices. */
ONCE const XDATA uint8_t *find(uint8_t type, uint8_t index)
{
    const XDATA uint8_t *at = descriptor_data;

    do {
        uint8_t holds_others = at[AT_TYPE] == USB_DESCRIPTOR_BOS || at == CONFIGURATION;

        descriptor_length = at[holds_others ? AT_TOTAL_LENGTH : AT_LENGTH];
        if (at[AT_TYPE] == type && index-- == 0)
            return at;
        at += descriptor_length;
    } while (at != end);
    return NULL;
}

const XDATA uint8_t *descriptor_find(uint8_t type, uint8_t index)
{
    uint8_t other = type == USB_DESCRIPTOR_OTHER_SPEED;

    CONFIGURATION[AT_TYPE] = other ? type : USB_DESCRIPTOR_CONFIGURATION;
    set_packet_sizes(other);
    return find(type, index);
}

const XDATA uint8_t *descriptor_microsoft(void)
{
    descriptor_length = MICROSOFT_SIZE;
    return descriptor_data + MICROSOFT_AT;
}
