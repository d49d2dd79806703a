#include "app/configure.h"

#include "app/flash_chip.h"
#include "app/slot_store.h"
#include "board/turret.h"
#include "drivers/clock.h"
#include "drivers/flash_bus.h"
#include "drivers/flash_stream.h"
#include "drivers/fpga_port.h"
#include "drivers/usb_bulk.h"
#include "drivers/usb_stream.h"

#include <stddef.h>

/* The longest anything may take. The flash may still be erasing from before a reset of the FX2; the
 * FPGA clears its memory after PROG#; DONE rises within the bitstream's end. */
#define FLASH_READY_TICKS CLOCK_TICKS(2000000ul)
#define INIT_FALL_TICKS   CLOCK_TICKS(1000ul)
#define INIT_RISE_TICKS   CLOCK_TICKS(50000ul)
#define DONE_RISE_TICKS   CLOCK_TICKS(5000ul)
#define DATA_TICKS        CLOCK_TICKS(CONFIG_DATA_TIMEOUT_MS * 1000ul)

/* Blocks in one step: 4 milliseconds. */
#define BURST_BLOCKS 64u

/* What the next step does; NULL at rest. */
static void (*state)(void);
static uint8_t changing;         /* the FPGA is no longer what it was */
static XDATA uint16_t begun;     /* clock_ticks() when the job began */
static uint8_t from_usb;         /* the bytes come over USB */
static uint8_t cause;            /* why the golden slot is tried; CONFIG_OK if it is not */
static IDATA uint16_t blocks_in; /* from the flash: blocks that the FPGA has */
static IDATA uint16_t left_256;  /* from USB: as it was seen last */
static XDATA uint8_t status[CONFIG_STATUS_SIZE];
#define status_bytes (status + CONFIG_STATUS_AT_BYTES)
#define status_time  (status + CONFIG_STATUS_AT_TIME_US)

static void enter(void (*next)(void))
{
    state = next;
    clock_start_wait();
}

static void clear_bytes(void)
{
    uint8_t i;

    for (i = 0; i != 4; i++)
        status_bytes[i] = 0;
}

static void begin(uint8_t source, uint8_t slot)
{
    status[CONFIG_STATUS_AT_RESULT] = CONFIG_BUSY;
    status[CONFIG_STATUS_AT_SLOT] = slot;
    status[CONFIG_STATUS_AT_SOURCE] = source;
    status[CONFIG_STATUS_AT_CAUSE] = CONFIG_OK;
    cause = CONFIG_OK;
    begun = clock_ticks();
    clear_bytes();
}

static void await_flash(void);
static void await_init_low(void);
static void stream_usb(void);

static void begin_flash(void)
{
    from_usb = 0;
    changing = 0;
    flash_bus_select();
    enter(await_flash);
}

static void begin_full(void)
{
    changing = 1;
    clear_bytes();
    fpga_port_program(1);
    enter(await_init_low);
}

static void begin_usb(void)
{
    changing = 1;
    fpga_port_select(1);
    usb_stream_begin(slot_store_length);
    enter(stream_usb);
}

void configure_from_flash(uint8_t slot)
{
    if (slot == CONFIG_BOOT_DEFAULT)
        begin(CONFIG_FROM_DEFAULT, CONFIG_NO_SLOT);
    else
        begin(CONFIG_FROM_SLOT, slot);
    begin_flash();
}

uint8_t configure_from_usb(uint8_t kind)
{
    if (!slot_store_header_fits())
        return 0;
    if (kind == CONFIG_BEGIN_PARTIAL && !fpga_port_done_level())
        return 0;
    usb_bulk_reset(); /* as store_begin() does, and why */
    begin(CONFIG_FROM_USB + kind, CONFIG_NO_SLOT);
    from_usb = 1;
    if (kind == CONFIG_BEGIN_PARTIAL)
        begin_usb();
    else
        begin_full();
    return 1;
}

static void release(void)
{
    flash_stream_end();
    fpga_port_select(0);
    flash_bus_release();
}

/* In us: 64 a tick. */
ONCE void put_time(uint16_t ticks)
{
    status_time[1] = (uint8_t)(ticks >> 10);
    status_time[2] = (uint8_t)(ticks >> 2);
    status_time[3] = (uint8_t)((uint8_t)ticks << 6);
}

static void finish(uint8_t result)
{
    from_usb = 0;
    release();
    status[CONFIG_STATUS_AT_RESULT] = result;
    put_time((uint16_t)(clock_ticks() - begun));
    state = NULL;
}

/* Whatever the FPGA has taken, it shall not start with it: erase it. Then try the golden slot. */
static void fail(uint8_t result)
{
    if (from_usb) {
        usb_stream_end();
        usb_bulk_halt(USB_BULK_OUT, 1);
    }
    if (changing)
        fpga_port_program(1);
    release();
    fpga_port_program(0);
    if (cause == CONFIG_OK && result != CONFIG_NO_FLASH) {
        cause = result;
        begin_flash();
    } else if (cause != CONFIG_OK && status[CONFIG_STATUS_AT_CAUSE] == CONFIG_OK) {
        finish(cause); /* there is no golden slot */
    } else {
        finish(result);
    }
}

static void await_done(void);

void configure_abort(void)
{
    if (from_usb && state != await_done)
        fail(CONFIG_ABORTED);
}

static void find_slot(void);

static void await_flash(void)
{
    if (flash_bus_ready())
        enter(find_slot);
    else if (clock_waited(FLASH_READY_TICKS))
        fail(CONFIG_NO_FLASH);
}

/* Leaves the slot in the status. Returns CONFIG_OK or what is wrong. */
ONCE uint8_t choose_slot(void)
{
    static uint8_t slot;

    slot = status[CONFIG_STATUS_AT_SLOT];
    if (!flash_chip_identify())
        return CONFIG_NO_FLASH;
    if (cause != CONFIG_OK)
        slot = slot_store_marked(SLOT_RECORD_GOLDEN);
    else if (status[CONFIG_STATUS_AT_SOURCE] == CONFIG_FROM_DEFAULT)
        slot = slot_store_marked(SLOT_RECORD_DEFAULT);
    if (slot == CONFIG_NO_SLOT)
        return CONFIG_NO_DEFAULT;
    if (cause != CONFIG_OK) {
        status[CONFIG_STATUS_AT_SOURCE] = CONFIG_FROM_GOLDEN;
        status[CONFIG_STATUS_AT_CAUSE] = cause;
    }
    status[CONFIG_STATUS_AT_SLOT] = slot;
    slot_store_find(slot);
    return slot_store_bank == NO_BANK ? CONFIG_BAD_SLOT : CONFIG_OK;
}

/* Look for the bitstream before the FPGA loses the one it has. */
static void find_slot(void)
{
    uint8_t result = choose_slot();

    if (result == CONFIG_OK)
        begin_full();
    else
        fail(result);
}

static void await_init_high(void);
static void stream_flash(void);
static void await_done(void);

/* With PROG# low the FPGA holds INIT# low; without an FPGA the pull-up keeps it high. */
static void await_init_low(void)
{
    if (!fpga_port_init_level()) {
        fpga_port_program(0);
        enter(await_init_high);
    } else if (clock_waited(INIT_FALL_TICKS)) {
        fail(CONFIG_NO_INIT);
    }
}

static void await_init_high(void)
{
    if (fpga_port_init_level()) {
        if (from_usb) {
            begin_usb();
        } else {
            fpga_port_select(1);
            slot_store_go_to(slot_store_bank, 0);
            flash_stream_begin(flash_at_block);
            blocks_in = 0;
            enter(stream_flash);
        }
    } else if (clock_waited(INIT_RISE_TICKS)) {
        fail(CONFIG_NO_INIT);
    }
}

static void tell_length(void)
{
    uint8_t i;

    for (i = 0; i != sizeof slot_store_length; i++)
        status_bytes[i] = slot_store_length[i];
}

static void put_bytes_256(uint16_t number)
{
    status_bytes[1] = (uint8_t)(number >> 8);
    status_bytes[2] = (uint8_t)number;
}

/* The last block is streamed whole: behind the bitstream the flash is erased, and FF are the dummy
 * words of Virtex. */
static void stream_flash(void)
{
    static uint8_t count;

    count = BURST_BLOCKS;
    if (slot_store_blocks < BURST_BLOCKS)
        count = (uint8_t)slot_store_blocks;
    slot_store_blocks -= count;
    blocks_in += count;
    put_bytes_256((uint16_t)(blocks_in << 1));
    if (!flash_stream_blocks(count)) {
        fail(CONFIG_BUS_STUCK);
    } else if (!fpga_port_init_level()) {
        fail(CONFIG_CRC_ERROR);
    } else if (slot_store_blocks == 0) {
        tell_length();
        enter(await_done);
    }
}

ONCE void watch_progress(void)
{
    uint16_t now = usb_stream_left_256();

    if (now != left_256)
        clock_start_wait();
    left_256 = now;
    put_bytes_256((uint16_t)(slot_store_length_256 - now));
}

static void stream_usb(void)
{
    watch_progress();
    if (!fpga_port_init_level()) {
        fail(CONFIG_CRC_ERROR);
    } else if (usb_stream_done()) {
        tell_length();
        if (usb_stream_surplus()) {
            fail(CONFIG_TOO_LONG);
        } else {
            usb_stream_end();
            enter(await_done);
        }
    } else if (clock_waited(DATA_TICKS)) {
        fail(CONFIG_NO_DATA);
    }
}

static void await_done(void)
{
    if (!fpga_port_init_level())
        fail(CONFIG_CRC_ERROR);
    else if (fpga_port_done_level())
        finish(CONFIG_OK);
    else if (clock_waited(DONE_RISE_TICKS))
        fail(CONFIG_NO_DONE);
}

uint8_t configure_step(void)
{
    if (state != NULL)
        state();
    return configure_busy();
}

uint8_t configure_busy(void)
{
    if (state == NULL)
        return 0;
    return 1;
}

const XDATA uint8_t *configure_status(void)
{
    uint8_t pins = 0;

    status[0] = CONFIG_STATUS_VERSION;
    if (fpga_port_init_level())
        pins |= 1u;
    if (fpga_port_done_level())
        pins |= 2u;
    status[CONFIG_STATUS_AT_PINS] = pins;
    return status;
}
