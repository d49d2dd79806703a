/* Finding bitstreams in the flash. The layout is that of link/slots.h.
 *
 * The flash is selected, ready and reading its array. */
#ifndef APP_SLOT_STORE_H
#define APP_SLOT_STORE_H

#include "drivers/compiler.h"

#include <stdint.h>

/* A bitstream in the flash. */
typedef struct {
    uint16_t block;  /* of 512 bytes, where it begins */
    uint32_t length; /* bytes, 1..BANK_HEADER_AT */
} stored_bitstream_t;

/* The slot marked as default (0..31), or CONFIG_NO_SLOT if none is: the one whose DEFAULT record
 * has the highest sequence number, in either of its banks. Takes about 2 ms. */
uint8_t slot_store_default(void);

/* Find the whole bitstream of slot `slot` (0..31): of its banks with a sound header and a commit
 * word the one with the higher generation. Returns 1, or 0 and leaves *found alone if there is
 * none. */
uint8_t slot_store_find(uint8_t slot, XDATA stored_bitstream_t *found);

#endif
