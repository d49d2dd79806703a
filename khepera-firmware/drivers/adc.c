#include "drivers/adc.h"

#include "board/khepera.h"
#include "board/mc68331.h"
#include "drivers/qspi.h"

/* A word asks for an input and brings the one asked for by the word before: one more than inputs.
 */
#define WORDS         (ADC_INPUTS + 1u)
#define CONVERSION_US 23u
#define INPUT_SHIFT   12
#define RESULT_SHIFT  6
#define AFTER_RESULT  0x003Fu /* bits below a result: 0, if anybody drives the line */
/* Ticks without an answer after which the converter is taken for dead. */
#define SILENT_TICKS  10u

static void readings_done(const volatile uint16_t *received);

static qspi_job_t job = {WORDS, BOARD_PCS_ADC, 0, CONVERSION_US, 1, {0}, readings_done};
/* Written by the interrupt at a run's end. */
static adc_readings_t newest;
static volatile uint8_t ticks_without; /* an answer; saturates */
static uint8_t emitters_on;
/* Ticks 0, 2, 4, 6, 8 of ten read proximity, tick 9 ambient light: the emitters are switched a tick
 * before. */
static uint8_t phase;
#define PHASES        10u
#define PHASE_AMBIENT 9u

static void set_emitters(uint8_t on)
{
    uint8_t pin = 1u << BOARD_PF_EMITTERS;

    emitters_on = on;
    PORTF = (uint8_t)(on ? PORTF | pin : PORTF & ~pin);
}

static int are_results(const volatile uint16_t *word)
{
    uint16_t any = 0;
    unsigned left;

    for (left = ADC_INPUTS; left > 0; left--)
        any |= *word++;
    return (any & AFTER_RESULT) == 0;
}

static void keep(uint16_t *reading, const volatile uint16_t *word, unsigned count)
{
    for (; count > 0; count--)
        *reading++ = (uint16_t)(*word++ >> RESULT_SHIFT);
}

static void readings_done(const volatile uint16_t *received)
{
    const volatile uint16_t *results = &received[1];

    if (!are_results(results))
        return;
    ticks_without = 0;
    keep(emitters_on ? newest.input : newest.ambient, results, ADC_SENSORS);
    keep(&newest.input[ADC_SENSORS], &results[ADC_SENSORS], ADC_INPUTS - ADC_SENSORS);
    set_emitters(phase != PHASE_AMBIENT - 1u);
}

void adc_init(void)
{
    unsigned i;

    for (i = 0; i < ADC_INPUTS; i++) {
        job.send[i] = (uint16_t)(i << INPUT_SHIFT);
        newest.input[i] = 0;
    }
    for (i = 0; i < ADC_SENSORS; i++)
        newest.ambient[i] = 0;
    ticks_without = 0;
    phase = PHASES - 1u;
    set_emitters(1);
}

void adc_tick(void)
{
    if (++phase == PHASES)
        phase = 0;
    if (ticks_without < SILENT_TICKS)
        ticks_without++;
    if (phase % 2u == 0 || phase == PHASE_AMBIENT)
        qspi_start(QSPI_ADC, &job);
}

void adc_read(adc_readings_t *readings)
{
    /* Each value is written in one instruction; two of different readings are no harm. */
    *readings = newest;
    readings->silent = ticks_without >= SILENT_TICKS;
}
