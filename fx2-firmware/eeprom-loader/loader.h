/* The EEPROM loader: writes the boot EEPROM, from which it is never started itself. The host puts
 * it into the FX2's RAM (request A0) and talks to it by the requests of link/eeprom.h.
 *
 * Wherever its work is cut off, byte 0 of the EEPROM is FF, and the FX2 then starts as a blank chip
 * that a host can load again, or everything is written and verified. */
#ifndef EEPROM_LOADER_LOADER_H
#define EEPROM_LOADER_LOADER_H

#include <stdint.h>

/* Serve what has happened on USB since the last call. Returns 1 after a bus reset: USB is to be
 * given back to the chip. */
uint8_t loader_poll(void);

#endif
