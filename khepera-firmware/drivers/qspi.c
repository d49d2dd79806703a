#include "drivers/qspi.h"

#include <stddef.h>

#include "board/khepera.h"
#include "board/mc68331.h"

#define PORTQS_IDLE     0x78             /* PCS3..0 high, SCK low (CPOL = 0) */
#define PQSPAR_VALUE    0x7B             /* PCS3..0, MOSI, MISO belong to the QSPI */
#define DDRQS_VALUE     0x7E             /* all of them but MISO are outputs */
#define SPCR0_VALUE     (SPCR0_MSTR | 6) /* 16 bits, mode 0, 25.166 MHz / 12 */
/* SPCR1.DTL counts 32 clocks. */
#define DELAY_PER_US_Q5 (BOARD_SYSTEM_HZ / 1000000u)
/* A run takes 0.4 ms at most: one that lasts a whole tick is dead. */
#define RUN_TICKS       2u

/* Shared by interrupts and program; the program masks interrupts around it. */
static const qspi_job_t *volatile waiting[QSPI_OWNER_COUNT];
static const qspi_job_t *volatile running;
static volatile uint8_t ticks_left;
static const qspi_job_t *loaded; /* whose commands and words lie in the queue, */
static uint16_t loaded_spcr1;    /* ... and what starts it */
static uint16_t loaded_spcr2;
static volatile uint8_t owner_running;

void qspi_init(void)
{
    unsigned i;

    for (i = 0; i < QSPI_OWNER_COUNT; i++)
        waiting[i] = NULL;
    running = NULL;
    loaded = NULL;
    QSMCR = 0x0080 | IARB_QSM; /* supervisor access only, as after reset */
    QILR = (LEVEL_TURRET << 3) | LEVEL_CONSOLE;
    QIVR = VECTOR_SCI;
    PORTQS = PORTQS_IDLE;
    PQSPAR = PQSPAR_VALUE;
    DDRQS = DDRQS_VALUE;
    SPCR0 = SPCR0_VALUE;
}

/* Two commands at a time: alike in all entries but the last. */
static void load_commands(const qspi_job_t *job)
{
    uint8_t command = (uint8_t)(QSPI_CMD_BITS | job->select);
    uint8_t last = command;
    unsigned i;

    if (job->delay_us > 0)
        command |= QSPI_CMD_DT;
    last = command;
    if (job->keep_selected)
        command |= QSPI_CMD_CONT;
    for (i = 0; i < job->words; i += 2)
        QSPI_CMD_PAIR(i) = (uint16_t)(command << 8 | command);
    QSPI_CMD(job->words - 1u) = last;
    loaded_spcr2 = (uint16_t)(SPCR2_SPIFIE | (uint16_t)((job->words - 1u) << 8));
    loaded_spcr1 = (uint16_t)(SPCR1_SPE | (job->delay_us * DELAY_PER_US_Q5 / 32u + 1u));
}

static void load_words(const qspi_job_t *job)
{
    const uint16_t *word = job->send;
    volatile uint16_t *queue = &QSPI_TX(0);
    unsigned left;

    /* Four at a time; what lies behind the last word is not sent. */
    for (left = (job->words + 3u) / 4u; left > 0; left--) {
        *queue++ = *word++;
        *queue++ = *word++;
        *queue++ = *word++;
        *queue++ = *word++;
    }
}

/* Begin the most urgent run that waits. Interrupts are masked, or this is one of level
 * LEVEL_TURRET, and nobody above it comes here. */
static void begin(void)
{
    unsigned owner = 0;
    const qspi_job_t *job;

    if (running != NULL)
        return;
    while (waiting[owner] == NULL)
        if (++owner == QSPI_OWNER_COUNT)
            return;
    job = waiting[owner];
    waiting[owner] = NULL;
    running = job;
    owner_running = (uint8_t)owner;
    ticks_left = RUN_TICKS;
    if (loaded != job)
        load_commands(job);
    if (loaded != job || !job->constant)
        load_words(job);
    loaded = job;
    SPCR2 = loaded_spcr2;
    SPCR1 = loaded_spcr1;
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

    (void)SPSR;
    SPSR = 0;
    if (job == NULL)
        return;
    running = NULL;
    job->done(&QSPI_RX(0));
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
