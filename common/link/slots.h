/* The bitstream store: how 32 bitstreams lie in the turret's 16 MiB flash.
 *
 *   slot n = bytes n*512 KiB ..., two banks of 256 KiB each, of which the newest whole one counts:
 *
 *   bank + 0x00000  bitstream (raw configuration bytes, first byte first)
 *   bank + 0x3F000  header (64 bytes)
 *   bank + 0x3F040  commit word (4 bytes), programmed last: without it the bank is not there
 *   bank + 0x3F080  records (8 bytes each, append-only, to the bank's end): "this slot is default"
 *
 * A write goes to the bank that does not count, so a power cut never costs the good copy. The slot
 * whose DEFAULT record has the highest sequence number is the default slot; likewise GOLDEN.
 * All integers big-endian. docs/SPEC.md section 3 owns the layout and gives golden bytes. */
#ifndef LINK_SLOTS_H
#define LINK_SLOTS_H

#include <stdint.h>

#define FLASH_SIZE        0x1000000ul /* 16 MiB, erased = FF */
#define FLASH_SECTOR_SIZE 0x10000ul
#define SLOT_COUNT        32u
#define SLOT_SIZE         0x80000ul
#define SLOT_BANKS        2u
#define BANK_SIZE         0x40000ul
#define BANK_HEADER_AT    0x3F000ul /* also the largest bitstream, in bytes */
#define BANK_COMMIT_AT    0x3F040ul
#define BANK_RECORDS_AT   0x3F080ul

/* First byte of bank `bank` (0..1) of slot `slot` (0..31) in the flash. */
#define BANK_ADDRESS(slot, bank) ((uint32_t)(slot)*SLOT_SIZE + (uint32_t)(bank)*BANK_SIZE)

#define SLOT_HEADER_SIZE    64u
#define SLOT_HEADER_MAGIC   0x534C4F54ul /* "SLOT" */
#define SLOT_HEADER_VERSION 1u
#define SLOT_COMMIT_WORD    0x434F4D54ul /* "COMT" */
#define SLOT_COMMIT_SIZE    4u
#define SLOT_PART_SIZE      16u
#define SLOT_NAME_SIZE      24u

typedef struct {
    uint8_t function;          /* FPGA_FUNCTION_* the bitstream says it brings; informative */
    uint32_t length;           /* bytes of bitstream, 1..BANK_HEADER_AT */
    uint32_t crc32;            /* CRC-32 of the bitstream */
    uint32_t generation;       /* the whole bank with the higher one counts */
    char part[SLOT_PART_SIZE]; /* e.g. "v300ecs144", NUL-padded, NUL-terminated */
    char name[SLOT_NAME_SIZE]; /* free text, NUL-padded, NUL-terminated */
} slot_header_t;

typedef enum {
    SLOT_OK = 0,
    SLOT_EMPTY = -1,       /* erased: no header here */
    SLOT_BAD_HEADER = -2,  /* magic or CRC wrong: an interrupted write, or not ours */
    SLOT_BAD_VERSION = -3, /* whole, but of a version this side does not know */
    SLOT_BAD_LENGTH = -4   /* length 0 or beyond the bank */
} slot_error_t;

/* Encode into wire[0..63]. The caller keeps length within 1..BANK_HEADER_AT. */
void slot_header_encode(const slot_header_t *header, uint8_t wire[SLOT_HEADER_SIZE]);

/* Decode wire[0..63]. On any error *header is left as it was. */
slot_error_t slot_header_decode(const uint8_t wire[SLOT_HEADER_SIZE], slot_header_t *header);

#define SLOT_RECORD_SIZE    8u
#define SLOT_RECORD_DEFAULT 0x44u /* 'D' */
#define SLOT_RECORD_GOLDEN  0x47u /* 'G' */
#define SLOT_RECORD_FREE    0xFFu

/* Encode a record into wire[0..7]. kind: SLOT_RECORD_DEFAULT or _GOLDEN. */
void slot_record_encode(uint8_t kind, uint32_t sequence, uint8_t wire[SLOT_RECORD_SIZE]);

/* Kind of the record at wire[0..7] and its sequence number: SLOT_RECORD_DEFAULT, _GOLDEN,
 * SLOT_RECORD_FREE for an erased place (the records end here), or 0 for a damaged record (skip it).
 * *sequence is filled for the first two only. */
uint8_t slot_record_decode(const uint8_t wire[SLOT_RECORD_SIZE], uint32_t *sequence);

#endif
