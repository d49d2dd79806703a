/* The base's two LEDs. turret_init() makes their pins outputs. */
#ifndef DRIVERS_LEDS_H
#define DRIVERS_LEDS_H

#include <stdint.h>

/* Bit 0 = LED 0, bit 1 = LED 1; 1 = on. */
void leds_show(uint8_t leds);

#endif
