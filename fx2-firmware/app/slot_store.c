#include "app/slot_store.h"

#include "board/turret.h"
#include "drivers/compiler.h"
#include "drivers/flash_bus.h"
#include "link/bytes.h"
#include "link/requests.h"
#include "link/slots.h"

/* A bank in blocks of the flash bus, and its last 4 KiB as offsets from their beginning. */
#define BANK_BLOCKS   ((uint16_t)(BANK_SIZE / TURRET_FLASH_BLOCK))
#define TAIL_BLOCK    ((uint16_t)(BANK_HEADER_AT / TURRET_FLASH_BLOCK))
#define COMMIT_OFFSET ((uint16_t)(BANK_COMMIT_AT - BANK_HEADER_AT))
#define RECORD_OFFSET ((uint16_t)(BANK_RECORDS_AT - BANK_HEADER_AT))
#define RECORD_PLACES ((uint16_t)((BANK_SIZE - BANK_RECORDS_AT) / SLOT_RECORD_SIZE))
#define BANK_COUNT    ((uint8_t)(SLOT_COUNT * SLOT_BANKS))

static XDATA uint8_t wire[SLOT_HEADER_SIZE];
static uint16_t tail;     /* block where the last 4 KiB of the bank in question begin */
static uint32_t sequence; /* of the record read last, if it is sound */

/* The highest number seen since any_number was cleared. */
static uint32_t highest;
static uint8_t any_number;

/* 1 if `number` is higher than all before it, which it then replaces. */
static uint8_t is_highest(uint32_t number)
{
    if (any_number && number <= highest)
        return 0;
    any_number = 1;
    highest = number;
    return 1;
}

static void choose_bank(uint8_t number)
{
    tail = (uint16_t)(number * BANK_BLOCKS + TAIL_BLOCK);
}

static uint16_t record_offset(uint16_t place)
{
    return (uint16_t)(RECORD_OFFSET + place * SLOT_RECORD_SIZE);
}

/* 1 if place `place` of the chosen bank was never written (SLOT_RECORD_FREE). */
static uint8_t is_free(uint16_t place)
{
    return flash_bus_erased(tail, record_offset(place), SLOT_RECORD_SIZE);
}

/* The number of places in use. Records are only ever appended, so everything before the first free
 * place is in use and halving finds it. */
static uint16_t count_records(void)
{
    uint16_t used = 0;
    uint16_t unused = RECORD_PLACES;

    while (used < unused) {
        uint16_t place = (uint16_t)((used + unused) / 2u);

        if (is_free(place))
            unused = place;
        else
            used = (uint16_t)(place + 1u);
    }
    return used;
}

/* Leaves the newest DEFAULT record's number in `sequence`; 0 if the chosen bank has none. */
static uint8_t find_newest_default(void)
{
    uint16_t place;

    if (is_free(0)) /* as in most banks */
        return 0;
    place = count_records();
    while (place != 0) {
        place--;
        flash_bus_read(tail, record_offset(place), wire, SLOT_RECORD_SIZE);
        if (slot_record_decode(wire, &sequence) == SLOT_RECORD_DEFAULT)
            return 1;
    }
    return 0;
}

uint8_t slot_store_default(void)
{
    uint8_t chosen = CONFIG_NO_SLOT;
    uint8_t number;

    any_number = 0;
    for (number = 0; number < BANK_COUNT; number++) {
        choose_bank(number);
        if (find_newest_default() && is_highest(sequence))
            chosen = number / SLOT_BANKS;
    }
    return chosen;
}

/* Read the chosen bank's header into `wire`: 1 if it and the commit word are sound. */
static uint8_t read_header(void)
{
    flash_bus_read(tail, COMMIT_OFFSET, wire, SLOT_COMMIT_SIZE);
    if (be_get32(wire) != SLOT_COMMIT_WORD)
        return 0;
    flash_bus_read(tail, 0, wire, SLOT_HEADER_SIZE);
    return slot_header_check(wire) == SLOT_OK;
}

uint8_t slot_store_find(uint8_t slot, XDATA stored_bitstream_t *found)
{
    uint8_t bank;

    any_number = 0;
    for (bank = 0; bank < SLOT_BANKS; bank++) {
        choose_bank((uint8_t)(slot * SLOT_BANKS + bank));
        if (read_header() && is_highest(slot_header_generation(wire))) {
            found->block = (uint16_t)(tail - TAIL_BLOCK);
            found->length = slot_header_length(wire);
        }
    }
    return any_number;
}
