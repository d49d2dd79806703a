#include "drivers/turret.h"

#include "board/khepera.h"
#include "board/mc68331.h"
#include "drivers/interrupts.h"
#include "drivers/qspi.h"
#include "drivers/tick.h"
#include "link/bytes.h"
#include "link/registers.h"

#define ATTENTION_PIN  (1u << BOARD_TURRET_ATTENTION_IRQ) /* of port F */
#define REGISTER_WORDS (REGISTER_WRITE_BYTES / 2u)

static void report_done(const uint16_t received[16]);

/* Shared between both interrupts and the poll/take side, which mask interrupts around it. */
static qspi_job_t job = {16, BOARD_PCS_TURRET, 1, 0, {0}, report_done};
static struct {
    volatile uint8_t running;
    volatile uint8_t fresh; /* words[newest] has not been taken yet */
    uint8_t newest;
    uint8_t reading;              /* the interrupt writes to the other one */
    volatile uint8_t write_waits; /* write[] goes out with the next run */
    uint16_t write[REGISTER_WORDS];
    uint16_t words[2][16];
    uint16_t asked; /* tick_fine() at the attention interrupt of the current run */
    uint16_t words_asked[2];
    uint16_t overruns;
    uint16_t timeouts;
} turret;

static void count(uint16_t *counter)
{
    if (*counter < UINT16_MAX)
        (*counter)++;
}

/* Words 0..2 of the next run: a register write, or zeros, which are none. */
static void take_write(void)
{
    unsigned i;

    for (i = 0; i < REGISTER_WORDS; i++)
        job.send[i] = turret.write_waits ? turret.write[i] : 0;
    turret.write_waits = 0;
}

INTERRUPT void turret_attention_isr(void);
INTERRUPT void turret_attention_isr(void)
{
    turret.asked = tick_fine();
    PFPAR = 0;
    turret.running = 1;
    take_write();
    qspi_start(QSPI_TURRET, &job);
}

static void report_done(const uint16_t received[16])
{
    unsigned i;

    if (turret.fresh)
        count(&turret.overruns);
    turret.newest = !turret.reading;
    for (i = 0; i < 16; i++)
        turret.words[turret.newest][i] = received[i];
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
    turret.write_waits = 0;
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
    uint16_t status;
    unsigned i;

    if (!turret.fresh)
        return 0;
    status = access_mask_turret();
    turret.reading = turret.newest;
    turret.fresh = 0;
    access_restore(status);
    for (i = 0; i < 16; i++)
        be_put16(&wire[2 * i], turret.words[turret.reading][i]);
    *age_fine = (uint16_t)(tick_fine() - turret.words_asked[turret.reading]);
    return 1;
}

int turret_write(uint8_t address, uint16_t value)
{
    uint8_t wire[REGISTER_WRITE_BYTES];
    unsigned i;

    if (turret.write_waits)
        return 0;
    register_write_encode(address, value, wire);
    for (i = 0; i < REGISTER_WORDS; i++)
        turret.write[i] = be_get16(&wire[2 * i]);
    turret.write_waits = 1;
    return 1;
}

uint16_t turret_overruns(void)
{
    return turret.overruns;
}

uint16_t turret_timeouts(void)
{
    return turret.timeouts;
}
