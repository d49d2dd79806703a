#include "drivers/qspi.h"

#include <stddef.h>

#include "board/khepera.h"
#include "board/mc68331.h"

#define PORTQS_IDLE  0x78             /* PCS3..0 high, SCK low (CPOL = 0) */
#define PQSPAR_VALUE 0x7B             /* PCS3..0, MOSI, MISO belong to the QSPI */
#define DDRQS_VALUE  0x7E             /* all of them but MISO are outputs */
#define SPCR0_VALUE  (SPCR0_MSTR | 6) /* 16 bits, mode 0, 25.166 MHz / 12 */
#define DELAY_CLOCKS 32u              /* of SPCR1.DTL */
/* A run takes 0.4 ms at most: one that lasts a whole tick is dead. */
#define RUN_TICKS    2u

/* Shared by interrupts and program; the program masks interrupts around it. */
static const qspi_job_t *volatile waiting[QSPI_OWNER_COUNT];
static const qspi_job_t *volatile running;
static volatile uint8_t ticks_left;
static volatile uint8_t loaded; /* whose commands lie in the queue: 1 + owner, 0 = nobody's */
static volatile uint8_t owner_running;

void qspi_init(void)
{
    unsigned i;

    for (i = 0; i < QSPI_OWNER_COUNT; i++)
        waiting[i] = NULL;
    running = NULL;
    loaded = 0;
    QSMCR = 0x0080 | IARB_QSM; /* supervisor access only, as after reset */
    QILR = (LEVEL_TURRET << 3) | LEVEL_CONSOLE;
    QIVR = VECTOR_SCI;
    PORTQS = PORTQS_IDLE;
    PQSPAR = PQSPAR_VALUE;
    DDRQS = DDRQS_VALUE;
    SPCR0 = SPCR0_VALUE;
}

static void load_commands(const qspi_job_t *job)
{
    uint8_t command = (uint8_t)(QSPI_CMD_BITS | job->select);
    unsigned i;

    if (job->delay_us > 0)
        command |= QSPI_CMD_DT;
    for (i = 0; i < job->words; i++) {
        int goes_on = job->keep_selected && i + 1u < job->words;

        QSPI_CMD(i) = (uint8_t)(command | (goes_on ? QSPI_CMD_CONT : 0u));
    }
}

/* Begin the most urgent run that waits. Interrupts are masked, or this is one of level
 * LEVEL_TURRET, and nobody above it comes here. */
static void begin(void)
{
    unsigned owner = 0;
    const qspi_job_t *job;
    unsigned i;

    while (owner < QSPI_OWNER_COUNT && waiting[owner] == NULL)
        owner++;
    if (running != NULL || owner == QSPI_OWNER_COUNT)
        return;
    job = waiting[owner];
    waiting[owner] = NULL;
    running = job;
    owner_running = (uint8_t)owner;
    ticks_left = RUN_TICKS;
    if (loaded != owner + 1u) {
        load_commands(job);
        loaded = (uint8_t)(owner + 1u);
    }
    for (i = 0; i < job->words; i++)
        QSPI_TX(i) = job->send[i];
    SPCR2 = (uint16_t)(SPCR2_SPIFIE | (uint16_t)((job->words - 1u) << 8));
    SPCR1 =
        (uint16_t)(SPCR1_SPE | (job->delay_us * (BOARD_SYSTEM_HZ / 1000000u) / DELAY_CLOCKS + 1u));
}

void qspi_start(qspi_owner_t owner, const qspi_job_t *job)
{
    uint16_t status = access_mask_turret();

    waiting[owner] = job;
    begin();
    access_restore(status);
}

INTERRUPT void qspi_isr(void);
INTERRUPT void qspi_isr(void)
{
    const qspi_job_t *job = running;
    uint16_t received[16];
    unsigned i;

    (void)SPSR;
    SPSR = 0;
    if (job == NULL)
        return;
    for (i = 0; i < job->words; i++)
        received[i] = QSPI_RX(i);
    running = NULL;
    job->done(received);
    begin();
}

int qspi_poll(qspi_owner_t *owner)
{
    uint16_t status = access_mask_turret();
    int gave_up = 0;

    if (running != NULL && --ticks_left == 0) {
        /* Halting first lets the QSPI finish its word; its data is not used. */
        SPCR3 = SPCR3_HALT;
        SPCR1 = 0;
        SPCR3 = 0;
        running = NULL;
        *owner = (qspi_owner_t)owner_running;
        gave_up = 1;
        begin();
    }
    access_restore(status);
    return gave_up;
}
