#include "drivers/tick.h"

#include "board/mc68331.h"
#include "drivers/interrupts.h"

#define PIT_PERIOD      82     /* PTP = 0: 82 * 4 / 32768 Hz */
#define TCNT_DIVIDE_256 0x06   /* TMSK2.CPR */
#define GPTMCR_SUPV     0x0080 /* supervisor access only, as after reset */

/* Written by the tick interrupt, taken with interrupts masked by tick_take(). */
static volatile uint8_t pending;

volatile uint8_t interrupts_work;

INTERRUPT void tick_isr(void);
INTERRUPT void tick_isr(void)
{
    if (pending < UINT8_MAX)
        pending++;
    interrupts_work = 1;
}

void tick_init(void)
{
    GPTMCR = GPTMCR_SUPV | IARB_GPT;
    TMSK2 = TCNT_DIVIDE_256;
    PICR = (LEVEL_TICK << 8) | VECTOR_TICK;
    PITR = PIT_PERIOD;
}

uint8_t tick_take(void)
{
    uint16_t status = access_mask();
    uint8_t ticks = pending;

    pending = 0;
    access_restore(status);
    return ticks;
}

uint16_t tick_fine(void)
{
    return TCNT;
}

void watchdog_service(void)
{
    SWSR = 0x55;
    SWSR = 0xAA;
}

const char *reset_cause(void)
{
    static const struct {
        uint8_t bit;
        const char *name;
    } causes[] = {
        {0x40, "power"},        {0x80, "external"},      {0x20, "watchdog"},
        {0x10, "halt monitor"}, {0x04, "loss of clock"}, {0x02, "reset instruction"},
    };
    uint8_t cause = RSR;
    unsigned i;

    for (i = 0; i < sizeof causes / sizeof causes[0]; i++)
        if (cause & causes[i].bit)
            return causes[i].name;
    return "unknown";
}
