/* The analogue-to-digital converter on the QSPI: eight IR sensors, battery, free inputs.
 *
 * Every 20 ms all inputs are read with the IR emitters on (proximity: 0 far .. 1023 near), and
 * every 100 ms the eight sensors with the emitters off (ambient light: brighter is lower). */
#ifndef DRIVERS_ADC_H
#define DRIVERS_ADC_H

#include <stdint.h>

#define ADC_SENSORS    8u
#define ADC_INPUTS     11u
#define ADC_FULL_SCALE 1023u

typedef struct {
    uint16_t ambient[ADC_SENSORS]; /* in the order of K-Team's command O */
    uint16_t input[ADC_INPUTS];    /* 0..7: proximity in the order of command N; 8: battery */
    uint8_t silent;                /* the converter does not answer: what stands above is old */
} adc_readings_t;

/* Call once, after qspi_init(). */
void adc_init(void);

/* Once a tick: begins the readings that are due. */
void adc_tick(void);

/* The newest readings. */
void adc_read(adc_readings_t *readings);

#endif
