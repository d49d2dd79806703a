#include "drivers/tick.h"

#include "board/khepera.h"
#include "board/mc68331.h"
#include "drivers/interrupts.h"
#include "drivers/motors.h"

#define PIT_PERIOD      82 /* PTP = 0: 82 * 4 / 32768 Hz */
/* Counts of PWMCNT in one of the fine clock. */
#define PWMCNT_PER_FINE (BOARD_SYSTEM_HZ / MOTOR_CLOCK_DIVIDER / TICK_FINE_HZ)
#define GPTMCR_SUPV     0x0080 /* supervisor access only, as after reset */

/* Written by the tick interrupt, taken with interrupts masked by tick_take(). */
static volatile uint8_t pending;

volatile uint8_t interrupts_work;

/* The fine clock at a past moment in the upper half, and PWMCNT then in the lower. Written by the
 * tick interrupt. */
static volatile uint32_t fine_mark;

INTERRUPT void tick_isr(void);
INTERRUPT void tick_isr(void)
{
    uint32_t mark = fine_mark;
    uint16_t counts = (uint16_t)(PWMCNT - (uint16_t)mark);
    uint16_t rest = counts % PWMCNT_PER_FINE;

    fine_mark = (uint32_t)(uint16_t)((mark >> 16) + counts / PWMCNT_PER_FINE) << 16 |
                (uint16_t)(mark + counts - rest);
    if (pending < UINT8_MAX)
        pending++;
    interrupts_work = 1;
}

void tick_init(void)
{
    GPTMCR = GPTMCR_SUPV | IARB_GPT;
    fine_mark = PWMCNT;
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
    uint32_t mark = fine_mark; /* in one instruction: the tick may come right after it */
    uint16_t counts = (uint16_t)(PWMCNT - (uint16_t)mark);

    return (uint16_t)((mark >> 16) + counts / PWMCNT_PER_FINE);
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
