#include "drivers/turret.h"

#include <stddef.h>

#include "board/khepera.h"
#include "board/mc68331.h"
#include "drivers/interrupts.h"
#include "drivers/qspi.h"
#include "drivers/tick.h"
#include "link/bytes.h"
#include "link/registers.h"

#define ATTENTION_PIN (1u << BOARD_TURRET_ATTENTION_IRQ) /* of port F */
#define REPORT_WORDS  (TURRET_REPORT_BYTES / 2u)
#define WRITE_WORDS   (REGISTER_WRITE_BYTES / 2u)
#define READ_WORDS    (REGISTER_READ_BYTES / 2u)

static void report_done(const volatile uint16_t *received);
static void written(const volatile uint16_t *received);
static void answered(const volatile uint16_t *received);

/* Shared between both interrupts and the poll/take side, which mask interrupts around it. */
static qspi_job_t job = {REPORT_WORDS, BOARD_PCS_TURRET, 1, 0, 1, {0}, report_done};
static struct {
    volatile uint8_t running;
    volatile uint8_t fresh; /* words[newest] has not been taken yet */
    uint8_t newest;
    uint8_t reading; /* the interrupt writes to the other one */
    uint16_t words[2][REPORT_WORDS];
    uint16_t asked; /* tick_fine() at the attention interrupt of the current run */
    uint16_t words_asked[2];
    uint16_t overruns;
    uint16_t timeouts;
} turret;

/* A register's two runs. The program fills them while nothing is under way, the interrupts at their
 * ends set the state. */
static qspi_job_t write_job = {WRITE_WORDS, BOARD_PCS_TURRET, 1, 0, 0, {0}, written};
static qspi_job_t read_job = {READ_WORDS, BOARD_PCS_TURRET, 1, 0, 0, {0}, answered};
static volatile turret_register_t register_state;
static uint16_t register_value; /* valid in TURRET_REGISTER_READ */

static void count(uint16_t *counter)
{
    if (*counter < UINT16_MAX)
        (*counter)++;
}

INTERRUPT void turret_attention_isr(void);
INTERRUPT void turret_attention_isr(void)
{
    turret.asked = tick_fine();
    PFPAR = 0;
    turret.running = 1;
    qspi_start(QSPI_TURRET, &job);
}

static void report_done(const volatile uint16_t *received)
{
    uint16_t *word;
    unsigned left;

    if (turret.fresh)
        count(&turret.overruns);
    turret.newest = !turret.reading;
    word = turret.words[turret.newest];
    for (left = REPORT_WORDS; left > 0; left--)
        *word++ = *received++;
    turret.words_asked[turret.newest] = turret.asked;
    turret.fresh = 1;
    interrupts_work = 1;
    turret.running = 0;
    if (PORTF & ATTENTION_PIN)
        PFPAR = ATTENTION_PIN;
}

void turret_init(void)
{
    turret.running = 0;
    turret.fresh = 0;
    PFPAR = ATTENTION_PIN;
}

void turret_poll(int gave_up)
{
    uint16_t status = access_mask_turret();

    if (gave_up) {
        turret.running = 0;
        count(&turret.timeouts);
    }
    if (!turret.running)
        PFPAR = ATTENTION_PIN;
    access_restore(status);
}

int turret_take(uint8_t wire[TURRET_REPORT_BYTES], uint16_t *age_fine)
{
    const uint16_t *word;
    uint16_t status;
    unsigned left;

    if (!turret.fresh)
        return 0;
    status = access_mask_turret();
    turret.reading = turret.newest;
    turret.fresh = 0;
    access_restore(status);
    word = turret.words[turret.reading];
    for (left = REPORT_WORDS; left > 0; left--) {
        *wire++ = (uint8_t)(*word >> 8);
        *wire++ = (uint8_t)*word++;
    }
    *age_fine = (uint16_t)(tick_fine() - turret.words_asked[turret.reading]);
    return 1;
}

/* ---- Registers ---- */

static void written(const volatile uint16_t *received)
{
    (void)received;
    qspi_start(QSPI_REGISTER, &read_job);
}

static void answered(const volatile uint16_t *received)
{
    uint8_t wire[REGISTER_READ_BYTES];
    unsigned i;

    be_put16(wire, read_job.send[0]);
    for (i = 1; i < READ_WORDS; i++)
        be_put16(&wire[2 * i], received[i]);
    register_state =
        register_read_decode(wire, &register_value) ? TURRET_REGISTER_READ : TURRET_REGISTER_FAILED;
    interrupts_work = 1;
}

void turret_register_begin(uint8_t address, const uint16_t *value)
{
    uint8_t wire[REGISTER_WRITE_BYTES];
    unsigned i;

    register_state = TURRET_REGISTER_BUSY;
    read_job.send[0] = (uint16_t)(REGISTER_WORD_READ | (address & (FPGA_REG_COUNT - 1u)));
    if (value == NULL) {
        qspi_start(QSPI_REGISTER, &read_job);
        return;
    }
    register_write_encode(address, *value, wire);
    for (i = 0; i < WRITE_WORDS; i++)
        write_job.send[i] = be_get16(&wire[2 * i]);
    qspi_start(QSPI_REGISTER, &write_job);
}

turret_register_t turret_register_state(uint16_t *value)
{
    turret_register_t state = register_state;

    if (state == TURRET_REGISTER_READ)
        *value = register_value;
    return state;
}

void turret_register_give_up(void)
{
    register_state = TURRET_REGISTER_FAILED;
}

uint16_t turret_overruns(void)
{
    return turret.overruns;
}

uint16_t turret_timeouts(void)
{
    return turret.timeouts;
}
