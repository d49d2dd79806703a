/* The boot EEPROM, read only: what starts the FX2 is written by another program (eeprom-loader/).
 */
#ifndef APP_EEPROM_H
#define APP_EEPROM_H

#include "drivers/usb.h"
#include "link/requests.h"

#include <stdint.h>

/* What eeprom_read() has read: it lies where an answer to the host is wanted. */
#define eeprom_data usb_control_data

/* Read `length` bytes (0..EEPROM_READ_MAX) from `address` on; behind the end it goes on from 0.
 * 60 us a byte. 1, or 0 if the EEPROM does not answer. */
uint8_t eeprom_read(uint16_t address, uint8_t length);

#endif
