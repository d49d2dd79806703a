/* How headers and records lie in their bytes: for the codecs in this folder only. */
#ifndef LINK_SLOT_LAYOUT_H
#define LINK_SLOT_LAYOUT_H

#include <stdint.h>

/* Offsets of the header's wire format; docs/SPEC.md section 3. */
enum {
    AT_MAGIC = 0,
    AT_VERSION = 4,
    AT_FUNCTION = 5,
    AT_LENGTH = 8,
    AT_CRC32 = 12,
    AT_GENERATION = 16,
    AT_PART = 20,
    AT_NAME = 36,
    AT_CRC16 = 62,
    /* and of a record's */
    AT_SEQUENCE = 2
};

/* 1 if wire[0..size-1] are all FF. */
uint8_t slot_all_erased(const uint8_t *wire, uint8_t size);

#endif
