/* The turret's USB descriptors: USB 2.0 chapter 9.6, the BOS descriptor of its ECN on link power
 * management, and Microsoft's OS 2.0 descriptors, by which Windows loads WinUSB without a driver
 * file. */
#ifndef APP_DESCRIPTORS_H
#define APP_DESCRIPTORS_H

#include "drivers/compiler.h"

#include <stdint.h>

/* Descriptor types. */
#define USB_DESCRIPTOR_DEVICE        1u
#define USB_DESCRIPTOR_CONFIGURATION 2u
#define USB_DESCRIPTOR_STRING        3u
#define USB_DESCRIPTOR_INTERFACE     4u
#define USB_DESCRIPTOR_ENDPOINT      5u
#define USB_DESCRIPTOR_QUALIFIER     6u
#define USB_DESCRIPTOR_OTHER_SPEED   7u
#define USB_DESCRIPTOR_BOS           15u
#define USB_DESCRIPTOR_CAPABILITY    16u

/* The one configuration's value. */
#define USB_CONFIGURATION_VALUE 1u

/* Read the serial number from the EEPROM; before that, or if it holds none, there is none. */
void descriptors_init(void);

/* The descriptor of type `type` and index `index` as it reads at the present speed, a configuration
 * with all that belongs to it; NULL if there is none. Valid until the next call. */
const XDATA uint8_t *descriptor_find(uint8_t type, uint8_t index);

/* Microsoft's descriptor set: the answer to REQUEST_MICROSOFT with wIndex 7. */
#define MICROSOFT_DESCRIPTOR_INDEX 7u
const XDATA uint8_t *descriptor_microsoft(void);

/* Bytes of what either of them has found last. */
extern uint8_t descriptor_length;

#endif
