#include "loader/line.h"

#include "board/khepera.h"
#include "board/mc68331.h"

/* Time is told by the PWM's counter: what clocks TCNT can be chosen once only, and the program
 * does.
 */
#define PWMC_DIVIDE_128 0x60 /* PPR */
#define TICKS_PER_MS    197u /* 25.166 MHz / 128: 196.6; good enough for time-outs */
#define SCSR_TC         0x0080

static uint16_t last_count;
static uint16_t rest;
static uint32_t ms;
static uint8_t opened;

void clock_start(void)
{
    PWMC = PWMC_DIVIDE_128;
    last_count = PWMCNT;
    rest = 0;
    ms = 0;
}

void line_breathe(void)
{
    uint16_t count = PWMCNT;

    rest = (uint16_t)(rest + (uint16_t)(count - last_count));
    last_count = count;
    for (; rest >= TICKS_PER_MS; rest = (uint16_t)(rest - TICKS_PER_MS))
        ms++;
    SWSR = 0x55;
    SWSR = 0xAA;
}

uint32_t clock_ms(void)
{
    return ms;
}

static void wait_sent(void)
{
    while (!(SCSR & SCSR_TC))
        line_breathe();
}

void line_open(uint32_t baud)
{
    if (opened)
        wait_sent();
    SCCR1 = 0;
    SCCR0 = (uint16_t)((BOARD_SYSTEM_HZ + 16 * baud) / (32 * baud));
    SCCR1 = SCCR1_TE | SCCR1_RE;
    opened = 1;
}

void line_close(void)
{
    wait_sent();
    SCCR1 = 0;
    opened = 0;
}

int line_read(void)
{
    uint16_t status = SCSR;
    uint8_t character;

    if (!(status & SCSR_RDRF))
        return -1;
    character = (uint8_t)SCDR; /* the read clears the flags that SCSR's read showed */
    return status & SCSR_FE ? -1 : character;
}

void line_write(const uint8_t *bytes, uint16_t size)
{
    for (; size > 0; size--) {
        while (!(SCSR & SCSR_TDRE))
            line_breathe();
        SCDR = *bytes++;
    }
}
