/* The turret's USB descriptors (USB 2.0 chapter 9.6), as bytes. */
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

/* The one configuration's value. */
#define USB_CONFIGURATION_VALUE 1u

/* The descriptor of type `type` and index `index` as it reads at high (1) or full speed (0); NULL
 * if there is none. Valid until the next call. (XDATA: most lie in program memory, but that is
 * where the FX2's MOVX reads too.) */
const XDATA uint8_t *descriptor_find(uint8_t type, uint8_t index, uint8_t high_speed);

/* Bytes of a descriptor, of a configuration with all that belongs to it. Never a multiple of 64
 * that would need an empty packet of its own. */
uint8_t descriptor_length(const XDATA uint8_t *descriptor);

#endif
