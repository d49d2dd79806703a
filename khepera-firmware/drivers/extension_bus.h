/* The extension bus of K-Team's commands R and W: 64 bytes behind a chip select of their own. With
 * nothing plugged in, reads give 255 and writes are lost. */
#ifndef DRIVERS_EXTENSION_BUS_H
#define DRIVERS_EXTENSION_BUS_H

#include <stdint.h>

#define EXTENSION_BUS_SIZE 64u

/* Set the chip select up. Call once. */
void extension_bus_init(void);

/* Addresses 0..EXTENSION_BUS_SIZE-1. */
uint8_t extension_bus_read(uint8_t address);
void extension_bus_write(uint8_t address, uint8_t value);

#endif
