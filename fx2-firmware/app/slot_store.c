#include "app/slot_store.h"

#include "app/flash_chip.h"
#include "board/turret.h"
#include "drivers/flash_bus.h"
#include "link/crc.h"
#include "link/requests.h"
#include "link/slot_layout.h"

/* The last 4 KiB of a bank as offsets from their beginning. */
#define COMMIT_OFFSET ((uint16_t)(BANK_COMMIT_AT - BANK_HEADER_AT))
#define RECORD_OFFSET ((uint16_t)(BANK_RECORDS_AT - BANK_HEADER_AT))
#define RECORD_END    ((uint16_t)(BANK_SIZE - BANK_HEADER_AT))
#define BANK_COUNT    ((uint8_t)(SLOT_COUNT * SLOT_BANKS))
#define NUMBER_SIZE   4u

static const CODE uint8_t magic[] = {'S', 'L', 'O', 'T', SLOT_HEADER_VERSION};
static const CODE uint8_t commit_word[] = {'C', 'O', 'M', 'T'};
static const CODE uint8_t part[] = TURRET_FPGA_PART; /* with its NUL */

uint8_t slot_store_bank;
XDATA uint8_t slot_store_length[4];
uint16_t slot_store_length_256;
uint16_t slot_store_blocks;
XDATA AT(0xE7C0) uint8_t slot_store_header[SLOT_HEADER_SIZE];

/* A record. Its number is the highest that the search has met: a sequence number or a generation,
 * both big-endian. */
static XDATA uint8_t record[SLOT_RECORD_SIZE];
#define highest (record + AT_SEQUENCE)

void slot_store_go_to(uint8_t bank, uint16_t block)
{
    flash_at_block = (uint16_t)((uint16_t)bank << 9) + block; /* 512 blocks of 512 bytes each */
    flash_at_offset = 0;
}

/* What outlives a call of another function is static in this file: an 8051 pays dearly for its
 * stack. */
uint16_t slot_store_crc(const XDATA uint8_t *data, uint8_t length)
{
    static const XDATA uint8_t *next;
    static uint8_t left;
    uint16_t crc = CRC16_INIT;

    next = data;
    left = length;
    do {
        crc = crc16_ccitt_step(crc, *next++);
    } while (--left);
    return crc;
}

/* Put the CRC of what is before it at data[length]. */
static void seal(XDATA uint8_t *data, uint8_t length)
{
    static XDATA uint8_t *end;
    uint16_t crc;

    end = data + length;
    crc = slot_store_crc(data, length);
    *end++ = (uint8_t)(crc >> 8);
    *end = (uint8_t)crc;
}

static void copy_number(XDATA uint8_t *to, const XDATA uint8_t *from)
{
    uint8_t left = NUMBER_SIZE;

    do {
        *to++ = *from++;
    } while (--left);
}

static void begin_search(void)
{
    uint8_t i;

    slot_store_bank = NO_BANK;
    for (i = 0; i < NUMBER_SIZE; i++)
        highest[i] = 0;
}

/* The number at flash_page[at] is that of bank `bank`. */
static void consider(uint8_t at, uint8_t number_of)
{
    uint8_t i;

    for (i = 0; i < NUMBER_SIZE; i++) {
        uint8_t found = flash_page[(uint8_t)(at + i)];

        if (found < highest[i])
            return;
        if (found != highest[i])
            break;
    }
    slot_store_bank = number_of;
    copy_number(highest, flash_page + at);
}

static void count_up(void)
{
    uint8_t i = NUMBER_SIZE;

    do {
        i--;
    } while (++highest[i] == 0 && i != 0);
}

static uint8_t page_begins(const CODE uint8_t *expected, uint8_t at, uint8_t length)
{
    do {
        if (flash_page[at++] != *expected++)
            return 0;
    } while (--length);
    return 1;
}

uint8_t slot_store_header_fits(void)
{
    copy_number(slot_store_length, flash_page + AT_LENGTH);
    slot_store_length_256 = (uint16_t)((uint16_t)slot_store_length[1] << 8) | slot_store_length[2];
    slot_store_blocks = slot_store_length_256 >> 1;
    if (slot_store_length[3] || slot_store_length[2] & 1u)
        slot_store_blocks++;
    if (slot_store_length[0] || (uint16_t)(slot_store_blocks - 1u) >= BANK_HEADER_BLOCK ||
        slot_store_crc(flash_page, SLOT_HEADER_SIZE) || !page_begins(part, AT_PART, sizeof part))
        return 0;
    return page_begins(magic, 0, sizeof magic);
}

static uint8_t bank;           /* of a search */
static IDATA uint8_t measured; /* bank whose length was looked at last */

/* Read the bank's header into flash_page: 1 if it fits and the commit word is there. */
static uint8_t read_header(void)
{
    slot_store_go_to(bank, BANK_HEADER_BLOCK);
    flash_at_offset = COMMIT_OFFSET;
    flash_bus_read(flash_page, SLOT_COMMIT_SIZE);
    if (!page_begins(commit_word, 0, sizeof commit_word))
        return 0;
    flash_at_offset = 0;
    flash_bus_read(flash_page, SLOT_HEADER_SIZE);
    measured = bank;
    return slot_store_header_fits();
}

static void consider_header(void)
{
    if (read_header())
        consider(AT_GENERATION, bank);
    bank++;
}

void slot_store_find(uint8_t slot)
{
    bank = (uint8_t)(slot * SLOT_BANKS);
    begin_search();
    consider_header();
    consider_header();
    if (slot_store_bank != NO_BANK && slot_store_bank != measured) {
        bank = slot_store_bank;
        read_header(); /* for its length */
    }
}

void slot_store_complete_header(void)
{
    count_up();
    copy_number(slot_store_header + AT_GENERATION, highest);
    seal(slot_store_header, AT_CRC16);
}

uint8_t slot_store_commit(uint8_t of)
{
    uint8_t i;

    for (i = 0; i != SLOT_COMMIT_SIZE; i++)
        record[i] = commit_word[i];
    slot_store_go_to(of, BANK_HEADER_BLOCK);
    flash_at_offset = COMMIT_OFFSET;
    return flash_chip_program(record, SLOT_COMMIT_SIZE);
}

/* 1 if the place at flash_page was never written (SLOT_RECORD_FREE). */
ONCE uint8_t is_free(void)
{
    uint8_t i;

    for (i = 0; i < SLOT_RECORD_SIZE; i++) {
        if (flash_page[i] != 0xFF)
            return 0;
    }
    return 1;
}

static uint8_t wanted; /* kind of record */

/* Consider the bank's records of the wanted kind. Leaves the flash's address at its first free
 * place: they are only ever appended. */
static void search_records(void)
{
    slot_store_go_to(bank, BANK_HEADER_BLOCK);
    for (flash_at_offset = RECORD_OFFSET; flash_at_offset != RECORD_END;
         flash_at_offset += SLOT_RECORD_SIZE) {
        flash_bus_read(flash_page, SLOT_RECORD_SIZE);
        if (is_free())
            return;
        if (flash_page[0] == wanted && slot_store_crc(flash_page, SLOT_RECORD_SIZE) == 0)
            consider(AT_SEQUENCE, bank);
    }
}

uint8_t slot_store_marked(uint8_t kind)
{
    wanted = kind;
    begin_search();
    bank = 0;
    do {
        search_records();
    } while (++bank != BANK_COUNT);
    return slot_store_bank == NO_BANK ? CONFIG_NO_SLOT : slot_store_bank >> 1;
}

uint8_t slot_store_append(uint8_t to, uint8_t kind)
{
    static IDATA uint8_t target;

    target = to;
    slot_store_marked(kind);
    count_up();
    bank = target;
    wanted = 0; /* only look for a free place */
    search_records();
    if (flash_at_offset == RECORD_END)
        return STORE_RECORDS_FULL;
    record[0] = kind;
    record[1] = 0;
    seal(record, SLOT_RECORD_SIZE - 2);
    return flash_chip_program(record, SLOT_RECORD_SIZE);
}
