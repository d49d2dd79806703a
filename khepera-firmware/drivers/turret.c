#include "drivers/turret.h"

#include "board/khepera.h"
#include "board/mc68331.h"
#include "drivers/interrupts.h"
#include "drivers/tick.h"

#define ATTENTION_PIN (1u << BOARD_TURRET_ATTENTION_IRQ) /* of port F */
#define LED_PINS      ((1u << BOARD_PF_LED0) | (1u << BOARD_PF_LED1))
#define PORTQS_IDLE   0x78             /* PCS3..0 high, SCK low (CPOL = 0) */
#define PQSPAR_VALUE  0x7B             /* PCS3..0, MOSI, MISO belong to the QSPI */
#define DDRQS_VALUE   0x7E             /* all of them but MISO are outputs */
#define SPCR0_VALUE   (SPCR0_MSTR | 6) /* 16 bits, mode 0, 25.166 MHz / 12 */
#define SPCR2_VALUE   (SPCR2_SPIFIE | ((QSPI_ENTRIES - 1) << 8))
/* A run takes 0.13 ms: one that lasts a whole tick is dead. */
#define RUN_TICKS     2u

/* Shared between both interrupts and the poll/take side, which mask interrupts around it. */
static struct {
    volatile uint8_t running; /* ticks left for the run; 0 = no run */
    volatile uint8_t fresh;   /* wire[] has not been taken yet */
    uint8_t wire[TURRET_REPORT_BYTES];
    uint16_t asked; /* tick_fine() at the attention interrupt of the current run */
    uint16_t wire_asked;
    uint16_t overruns;
    uint16_t timeouts;
} turret;

static void count(uint16_t *counter)
{
    if (*counter < UINT16_MAX)
        (*counter)++;
}

void turret_attention_isr(void) __attribute__((interrupt_handler));
void turret_attention_isr(void)
{
    turret.asked = tick_fine();
    PFPAR = 0;
    turret.running = RUN_TICKS;
    SPCR2 = SPCR2_VALUE;
    SPCR1 = SPCR1_SPE;
}

void turret_transfer_isr(void) __attribute__((interrupt_handler));
void turret_transfer_isr(void)
{
    unsigned i;

    (void)SPSR;
    SPSR = 0;
    if (turret.fresh)
        count(&turret.overruns);
    for (i = 0; i < QSPI_ENTRIES; i++) {
        uint16_t word = QSPI_RX(i);

        turret.wire[2 * i] = (uint8_t)(word >> 8);
        turret.wire[2 * i + 1] = (uint8_t)word;
    }
    turret.wire_asked = turret.asked;
    turret.fresh = 1;
    interrupts_work = 1;
    turret.running = 0;
    if (PORTF & ATTENTION_PIN)
        PFPAR = ATTENTION_PIN;
}

void turret_init(void)
{
    unsigned i;

    QSMCR = 0x0080 | IARB_QSM; /* supervisor access only, as after reset */
    QILR = (LEVEL_TURRET << 3) | LEVEL_CONSOLE;
    QIVR = VECTOR_SCI;
    PORTQS = PORTQS_IDLE;
    PQSPAR = PQSPAR_VALUE;
    DDRQS = DDRQS_VALUE;
    SPCR0 = SPCR0_VALUE;
    for (i = 0; i < QSPI_ENTRIES; i++) {
        uint8_t more = i + 1 < QSPI_ENTRIES ? QSPI_CMD_CONT : 0;

        QSPI_CMD(i) = (uint8_t)(more | QSPI_CMD_BITS | BOARD_PCS_TURRET);
        QSPI_TX(i) = 0; /* words 0..2 without REGISTER_WORD_WRITE: no register write */
    }
    DDRF = LED_PINS;
    PFPAR = ATTENTION_PIN;
}

void turret_poll(void)
{
    uint16_t status = interrupts_mask();

    if (turret.running == 0) {
        PFPAR = ATTENTION_PIN;
    } else if (--turret.running == 0) {
        /* Halting first lets the QSPI finish its word; its data is not used. */
        SPCR3 = SPCR3_HALT;
        SPCR1 = 0;
        SPCR3 = 0;
        count(&turret.timeouts);
    }
    interrupts_restore(status);
}

int turret_take(uint8_t wire[TURRET_REPORT_BYTES], uint16_t *age_fine)
{
    uint16_t status = interrupts_mask();
    int fresh = turret.fresh;
    unsigned i;

    if (fresh) {
        for (i = 0; i < TURRET_REPORT_BYTES; i++)
            wire[i] = turret.wire[i];
        *age_fine = (uint16_t)(tick_fine() - turret.wire_asked);
        turret.fresh = 0;
    }
    interrupts_restore(status);
    return fresh;
}

uint16_t turret_overruns(void)
{
    return turret.overruns;
}

uint16_t turret_timeouts(void)
{
    return turret.timeouts;
}
