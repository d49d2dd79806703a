#include "app/configure.h"

#include "app/flash_chip.h"
#include "app/slot_store.h"
#include "board/turret.h"
#include "drivers/clock.h"
#include "drivers/compiler.h"
#include "drivers/flash_bus.h"
#include "drivers/flash_stream.h"
#include "drivers/fpga_port.h"
#include "link/bytes.h"

/* The longest anything may take. The flash may still be erasing from before a reset of the FX2; the
 * FPGA clears its memory after PROG#; DONE rises within the bitstream's end. */
#define FLASH_READY_TICKS CLOCK_TICKS(2000000ul)
#define INIT_FALL_TICKS   CLOCK_TICKS(1000ul)
#define INIT_RISE_TICKS   CLOCK_TICKS(50000ul)
#define DONE_RISE_TICKS   CLOCK_TICKS(5000ul)

/* Blocks in one step: a millisecond. */
#define BURST_BLOCKS 16u

typedef enum {
    AT_REST,
    AWAIT_FLASH,
    FIND_SLOT,
    AWAIT_INIT_LOW,
    AWAIT_INIT_HIGH,
    STREAM,
    AWAIT_DONE
} state_t;

static uint8_t state = AT_REST; /* state_t */
static uint16_t entered;        /* clock_ticks() when this state began */
static XDATA uint8_t status[CONFIG_STATUS_SIZE];
static XDATA stored_bitstream_t bitstream;
static uint16_t full_blocks; /* left to clock into the FPGA */
static uint16_t tail_bytes;  /* after them, 0..511 */

static void enter(uint8_t next)
{
    state = next;
    entered = clock_ticks();
}

static uint8_t expired(uint16_t limit_ticks)
{
    return (uint16_t)(clock_ticks() - entered) > limit_ticks;
}

static void finish(uint8_t result)
{
    flash_stream_end();
    fpga_port_select(0);
    flash_bus_release();
    status[CONFIG_STATUS_AT_RESULT] = result;
    be_put32(status + CONFIG_STATUS_AT_TIME_US, clock_us());
    state = AT_REST;
}

/* Whatever the FPGA has taken, it shall not start with it: erase it. */
static void fail(uint8_t result)
{
    fpga_port_select(0);
    fpga_port_program(1);
    finish(result);
    fpga_port_program(0);
}

void configure_start(void)
{
    if (state >= AWAIT_INIT_LOW)
        fail(CONFIG_BUSY);
    status[CONFIG_STATUS_AT_RESULT] = CONFIG_BUSY;
    status[CONFIG_STATUS_AT_SLOT] = CONFIG_NO_SLOT;
    be_put32(status + CONFIG_STATUS_AT_TIME_US, 0);
    bitstream.length = 0;
    full_blocks = 0;
    tail_bytes = 0;
    flash_bus_select();
    enter(AWAIT_FLASH);
}

static void await_flash(void)
{
    if (flash_bus_ready())
        enter(FIND_SLOT);
    else if (expired(FLASH_READY_TICKS))
        finish(CONFIG_NO_FLASH);
}

/* Look for the bitstream before the FPGA loses the one it has. */
static void find_slot(void)
{
    if (flash_chip_identify() != FLASH_OK) {
        finish(CONFIG_NO_FLASH);
        return;
    }
    status[CONFIG_STATUS_AT_SLOT] = slot_store_default();
    if (status[CONFIG_STATUS_AT_SLOT] == CONFIG_NO_SLOT) {
        finish(CONFIG_NO_DEFAULT);
        return;
    }
    if (!slot_store_find(status[CONFIG_STATUS_AT_SLOT], &bitstream)) {
        finish(CONFIG_BAD_SLOT);
        return;
    }
    full_blocks = (uint16_t)(bitstream.length / TURRET_FLASH_BLOCK);
    tail_bytes = (uint16_t)bitstream.length % TURRET_FLASH_BLOCK;
    fpga_port_program(1);
    enter(AWAIT_INIT_LOW);
}

/* With PROG# low the FPGA holds INIT# low; without an FPGA the pull-up keeps it high. */
static void await_init_low(void)
{
    if (!fpga_port_init_level()) {
        fpga_port_program(0);
        enter(AWAIT_INIT_HIGH);
    } else if (expired(INIT_FALL_TICKS)) {
        fail(CONFIG_NO_INIT);
    }
}

static void await_init_high(void)
{
    if (fpga_port_init_level()) {
        fpga_port_select(1);
        flash_stream_begin(bitstream.block);
        enter(STREAM);
    } else if (expired(INIT_RISE_TICKS)) {
        fail(CONFIG_NO_INIT);
    }
}

static void stream_burst(void)
{
    uint8_t count = BURST_BLOCKS;

    if (full_blocks < BURST_BLOCKS)
        count = (uint8_t)full_blocks;
    full_blocks -= count;
    if (!flash_stream_blocks(count, TURRET_FLASH_BLOCK))
        fail(CONFIG_BUS_STUCK);
    else if (!fpga_port_init_level())
        fail(CONFIG_CRC_ERROR);
}

static void stream_tail(void)
{
    uint16_t length = tail_bytes;

    tail_bytes = 0;
    if (length == 0 || flash_stream_blocks(1, length))
        enter(AWAIT_DONE);
    else
        fail(CONFIG_BUS_STUCK);
}

static void stream(void)
{
    if (full_blocks != 0)
        stream_burst();
    else
        stream_tail();
}

static void await_done(void)
{
    if (fpga_port_done_level())
        finish(CONFIG_OK);
    else if (!fpga_port_init_level())
        fail(CONFIG_CRC_ERROR);
    else if (expired(DONE_RISE_TICKS))
        fail(CONFIG_NO_DONE);
}

uint8_t configure_step(void)
{
    switch (state) {
    case AWAIT_FLASH:
        await_flash();
        break;
    case FIND_SLOT:
        find_slot();
        break;
    case AWAIT_INIT_LOW:
        await_init_low();
        break;
    case AWAIT_INIT_HIGH:
        await_init_high();
        break;
    case STREAM:
        stream();
        break;
    case AWAIT_DONE:
        await_done();
        break;
    default:
        break;
    }
    return state != AT_REST;
}

const XDATA uint8_t *configure_status(void)
{
    status[0] = CONFIG_STATUS_VERSION;
    status[CONFIG_STATUS_AT_PINS] =
        (uint8_t)(fpga_port_init_level() | (uint8_t)(fpga_port_done_level() << 1));
    be_put32(status + CONFIG_STATUS_AT_BYTES,
             bitstream.length - (uint32_t)full_blocks * TURRET_FLASH_BLOCK - tail_bytes);
    return status;
}

uint8_t configure_busy(void)
{
    return state != AT_REST;
}
