#include "app/store.h"

#include "app/flash_chip.h"
#include "app/slot_store.h"
#include "board/turret.h"
#include "drivers/clock.h"
#include "drivers/flash_bus.h"
#include "drivers/usb.h"
#include "drivers/usb_bulk.h"

#include <stddef.h>

/* Waiting is counted in periods of this length: a single one for the host, several for the flash,
 * whose sectors may take 8 s (CFI: 2^10 ms, at worst 2^3 times that). */
#define PERIOD_TICKS  CLOCK_TICKS(CONFIG_DATA_TIMEOUT_MS * 1000ul)
#define DATA_PERIODS  1u
#define FLASH_PERIODS 5u

#define COMMIT_OFFSET ((uint16_t)(BANK_COMMIT_AT - BANK_HEADER_AT))
#define BANK_SECTORS  ((uint8_t)(BANK_SIZE / FLASH_SECTOR_SIZE))

/* What the next step does; NULL at rest. */
static void (*state)(void);
static IDATA uint8_t periods;  /* that it has lasted already */
static uint8_t operation;      /* REQUEST_STORE_*: up to WRITE they move data over USB */
static uint8_t bank;           /* to be erased, and written */
static IDATA uint8_t counting; /* the bank of the slot that counts, or NO_BANK */
static IDATA uint8_t sectors_left;
static IDATA uint8_t banks_left;
/* What is read or written: where it began, and where it ends. The flash's address runs along. */
static IDATA uint16_t first_block;
static IDATA uint16_t end_block;
static IDATA uint16_t end_offset;
static XDATA uint8_t mark; /* kind of record to append */
static XDATA uint8_t status[STORE_STATUS_SIZE];
#define slot status[STORE_STATUS_AT_SLOT]

static XDATA uint8_t no_commit; /* 0: what destroys a commit word */

static void rewind(void)
{
    clock_start_wait();
    periods = 0;
}

static void enter(void (*next)(void))
{
    state = next;
    rewind();
}

static uint8_t late(uint8_t limit)
{
    if (clock_waited(PERIOD_TICKS)) {
        clock_start_wait();
        periods++;
    }
    return periods == limit;
}

void store_note_marks(void)
{
    flash_bus_select();
    status[STORE_STATUS_AT_DEFAULT] = slot_store_marked(SLOT_RECORD_DEFAULT);
    status[STORE_STATUS_AT_GOLDEN] = slot_store_marked(SLOT_RECORD_GOLDEN);
    flash_bus_release();
}

static void put_bytes(void)
{
    uint16_t blocks = flash_at_block - first_block;

    status[STORE_STATUS_AT_BYTES] = (uint8_t)(blocks >> 15);
    status[STORE_STATUS_AT_BYTES + 1] = (uint8_t)(blocks >> 7);
    status[STORE_STATUS_AT_BYTES + 2] = (uint8_t)(blocks << 1) | (uint8_t)(flash_at_offset >> 8);
    status[STORE_STATUS_AT_BYTES + 3] = (uint8_t)flash_at_offset;
}

static void finish(uint8_t result)
{
    status[STORE_STATUS_AT_RESULT] = result;
    state = NULL;
    if (operation >= REQUEST_STORE_ERASE)
        store_note_marks();
    else if (result != STORE_OK)
        usb_bulk_halt(operation == REQUEST_STORE_READ ? USB_BULK_IN : USB_BULK_OUT, 1);
    flash_bus_release();
}

static void await_flash(void);
static void prepare(void);
static void read(void);
static void await_erased(void);
static void write(void);

/* What the request asks of a job, by operation: 0 if it cannot be had. */
ONCE uint8_t prepare_read(void)
{
    /* The sum may be 2^16, which counts as 0: then it is too much as well. */
    first_block = usb_setup.value;
    end_block = (uint16_t)(first_block + usb_setup.index);
    slot = CONFIG_NO_SLOT;
    if ((uint16_t)(end_block - 1u) >= STORE_BLOCKS || end_block <= first_block)
        return 0;
    return 1;
}

ONCE uint8_t prepare_write(void)
{
    if (!slot_store_header_fits())
        return 0;
    end_block = slot_store_length_256 >> 1; /* from the bank's beginning */
    end_offset = (uint16_t)((slot_store_length_256 & 1u) << 8 | slot_store_length[3]);
    return 1;
}

uint8_t store_begin(void)
{
    uint8_t index = (uint8_t)usb_setup.index;

    if (usb_setup.number != REQUEST_STORE_READ) {
        if (usb_setup.value & ~(SLOT_COUNT - 1u))
            return 0;
        if (usb_setup.number == REQUEST_STORE_MARK &&
            (usb_setup.index >> 8 || (index != SLOT_RECORD_DEFAULT && index != SLOT_RECORD_GOLDEN)))
            return 0;
        if (usb_setup.number == REQUEST_STORE_WRITE && !prepare_write())
            return 0;
        mark = index;
        slot = (uint8_t)usb_setup.value;
        first_block = 0;
    } else if (!prepare_read()) {
        return 0;
    }
    operation = usb_setup.number;
    status[STORE_STATUS_AT_OPERATION] = operation;
    status[STORE_STATUS_AT_RESULT] = STORE_BUSY;
    flash_at_block = first_block;
    flash_at_offset = 0;
    put_bytes();
    /* A job before may have left 02 open: what came now would be lost when this one opens it. */
    usb_bulk_reset();
    flash_bus_select();
    enter(await_flash);
    return 1;
}

void store_abort(void)
{
    if (state != NULL && operation < REQUEST_STORE_ERASE)
        finish(STORE_ABORTED);
}

static void await_flash(void)
{
    if (flash_bus_ready())
        enter(prepare);
    else if (late(FLASH_PERIODS))
        finish(STORE_NO_FLASH);
}

static void erase_next_sector(void)
{
    sectors_left--;
    slot_store_go_to(bank, (uint16_t)((uint16_t)sectors_left << 7)); /* of 128 blocks */
    flash_chip_erase();
    enter(await_erased);
}

static void go_to_header(uint16_t offset)
{
    slot_store_go_to(bank, BANK_HEADER_BLOCK);
    flash_at_offset = offset;
}

/* Before anything else the bank must cease to count, and its header go before its bitstream. */
static void erase_bank(void)
{
    uint8_t result;

    go_to_header(COMMIT_OFFSET);
    result = flash_chip_program(&no_commit, 1);
    if (result != STORE_OK) {
        finish(result);
        return;
    }
    sectors_left = BANK_SECTORS;
    erase_next_sector();
}

/* A mark in the bank that is about to be erased moves to the one that counts. */
static uint8_t save_mark(uint8_t kind)
{
    slot_store_marked(kind);
    return slot_store_bank == bank ? slot_store_append(counting, kind) : STORE_OK;
}

static void prepare(void)
{
    static uint8_t result;

    result = STORE_OK;
    if (!flash_chip_identify()) {
        finish(STORE_NO_FLASH);
        return;
    }
    if (operation == REQUEST_STORE_READ) {
        flash_at_block = first_block;
        flash_at_offset = 0;
        enter(read);
        return;
    }
    slot_store_find(slot);
    counting = slot_store_bank;
    if (operation == REQUEST_STORE_MARK) {
        finish(counting == NO_BANK ? STORE_EMPTY_SLOT : slot_store_append(counting, mark));
        return;
    }
    bank = counting ^ 1u;
    if (counting == NO_BANK)
        bank = (uint8_t)(slot << 1);
    banks_left = SLOT_BANKS;
    if (operation == REQUEST_STORE_WRITE) {
        slot_store_complete_header();
        banks_left = 1;
        if (counting != NO_BANK) {
            result = save_mark(SLOT_RECORD_DEFAULT);
            if (result == STORE_OK)
                result = save_mark(SLOT_RECORD_GOLDEN);
        }
    }
    if (result == STORE_OK)
        erase_bank();
    else
        finish(result);
}

ONCE void begin_data(void)
{
    slot_store_go_to(bank, 0);
    first_block = flash_at_block;
    end_block += first_block;
    usb_bulk_arm();
    enter(write);
}

ONCE void bank_is_erased(void)
{
    if (operation == REQUEST_STORE_WRITE) {
        begin_data();
    } else if (--banks_left != 0) {
        bank ^= 1u;
        erase_bank();
    } else {
        finish(STORE_OK);
    }
}

static void await_erased(void)
{
    if (!flash_bus_ready()) {
        if (late(FLASH_PERIODS))
            finish(STORE_TIMEOUT);
    } else if (!flash_chip_erased()) {
        finish(STORE_ERASE_FAILED);
    } else if (sectors_left != 0) {
        erase_next_sector();
    } else {
        bank_is_erased();
    }
}

/* To the next block if this one is over. */
static void turn_block(void)
{
    if (flash_at_offset == TURRET_FLASH_BLOCK) {
        flash_at_offset = 0;
        flash_at_block++;
    }
}

static void read(void)
{
    static XDATA uint8_t *to;

    if (!usb_bulk_in_room()) {
        if (late(DATA_PERIODS))
            finish(STORE_NO_DATA);
        return;
    }
    to = usb_bulk_in_buffer;
    do {
        flash_bus_read(to, FLASH_PAGE);
        to += FLASH_PAGE;
        flash_at_offset += FLASH_PAGE;
    } while (to != usb_bulk_in_buffer + usb_bulk_packet);
    turn_block();
    put_bytes();
    usb_bulk_in_send();
    rewind();
    if (flash_at_block == end_block)
        finish(STORE_OK);
}

static uint8_t commit(void)
{
    uint8_t result;

    go_to_header(0);
    result = flash_chip_program(slot_store_header, SLOT_HEADER_SIZE);
    if (result != STORE_OK)
        return result;
    return slot_store_commit(bank);
}

/* Program the packet that waits, page by page. */
ONCE uint8_t write_packet(void)
{
    static const XDATA uint8_t *from;
    static uint16_t bytes;
    static uint8_t count;
    uint8_t result;

    from = usb_bulk_out_buffer;
    for (bytes = usb_bulk_out_length(); bytes != 0; bytes -= count) {
        count = FLASH_PAGE - ((uint8_t)flash_at_offset & (FLASH_PAGE - 1u));
        if (bytes < count)
            count = (uint8_t)bytes;
        if (flash_at_block == end_block) {
            if (flash_at_offset == end_offset)
                return STORE_TOO_LONG;
            if (end_offset - flash_at_offset < count)
                count = (uint8_t)end_offset - (uint8_t)flash_at_offset;
        }
        result = flash_chip_program(from, count);
        if (result != STORE_OK)
            return result;
        from += count;
        turn_block();
    }
    put_bytes();
    return STORE_OK;
}

static void write(void)
{
    static uint8_t result;

    if (!usb_bulk_out_waits()) {
        if (late(DATA_PERIODS))
            finish(STORE_NO_DATA);
        return;
    }
    result = write_packet();
    usb_bulk_out_next();
    rewind();
    if (result == STORE_OK) {
        if (flash_at_block != end_block || flash_at_offset != end_offset)
            return;
        result = usb_bulk_out_waits() ? STORE_TOO_LONG : commit();
    }
    finish(result);
}

uint8_t store_step(void)
{
    if (state != NULL)
        state();
    return store_busy();
}

uint8_t store_busy(void)
{
    if (state == NULL)
        return 0;
    return 1;
}

const XDATA uint8_t *store_status(void)
{
    status[0] = STORE_STATUS_VERSION;
    return status;
}
