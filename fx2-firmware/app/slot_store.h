/* The bitstream store in the flash: what is where, and its marks. The layout is that of
 * link/slots.h.
 *
 * Banks are numbered 0..63: two for each slot. The flash is selected, ready and reading its array.
 * Arguments and results lie in fixed places where that saves code: an 8051 is poor in pointers. */
#ifndef APP_SLOT_STORE_H
#define APP_SLOT_STORE_H

#include "drivers/compiler.h"
#include "link/slots.h"

#include <stdint.h>

#define NO_BANK 0xFFu

/* The bank that the last search has found, or NO_BANK. */
extern uint8_t slot_store_bank;

/* Length of the bitstream that the last fitting header tells: as in the header; in units of 256
 * bytes, rounded down; and in blocks of 512, rounded up. */
extern XDATA uint8_t slot_store_length[4];
extern uint16_t slot_store_length_256;
extern uint16_t slot_store_blocks;

/* Set the flash's address to a block of bank `bank`. */
void slot_store_go_to(uint8_t bank, uint16_t block);
#define BANK_HEADER_BLOCK ((uint16_t)(BANK_HEADER_AT / 512u))

/* 1 if the header in flash_page is whole, its length possible and its part the board's. */
uint8_t slot_store_header_fits(void);

/* The slot with the newest record of `kind` (SLOT_RECORD_*), 0..31 or CONFIG_NO_SLOT. Leaves its
 * bank in slot_store_bank. Takes about 2 ms. */
uint8_t slot_store_marked(uint8_t kind);

/* The bank of slot `slot` (0..31) that counts: of those with a fitting header and a commit word the
 * one with the higher generation. Leaves it in slot_store_bank and its length in the variables
 * above; NO_BANK if there is none. */
void slot_store_find(uint8_t slot);

/* A header to be written, and what gives it the generation after that of the last
 * slot_store_find(), and its CRC: the chip's buffer of endpoint 1, which is not used. */
extern XDATA AT(0xE7C0) uint8_t slot_store_header[SLOT_HEADER_SIZE];
void slot_store_complete_header(void);

/* Program the commit word of bank `bank`: the bank counts from now on. Returns STORE_*. */
uint8_t slot_store_commit(uint8_t bank);

/* Append a record of `kind` with a new sequence number to bank `bank`. Returns STORE_*. */
uint8_t slot_store_append(uint8_t bank, uint8_t kind);

/* CRC-16 of `length` bytes (1..255); of data with their CRC behind them it is 0. */
uint16_t slot_store_crc(const XDATA uint8_t *data, uint8_t length);

#endif
