/* The base's two LEDs. */
#ifndef DRIVERS_LEDS_H
#define DRIVERS_LEDS_H

#include <stdint.h>

/* Makes the outputs of port F outputs: LEDs and IR emitters. Call once, before adc_init(). */
void leds_init(void);

/* Bit 0 = LED 0, bit 1 = LED 1; 1 = on. */
void leds_show(uint8_t leds);

#endif
