/* How headers and records lie in their bytes: for slots.c, and for the FX2, which
 * has no room for these codecs and checks in place. */
#ifndef LINK_SLOT_LAYOUT_H
#define LINK_SLOT_LAYOUT_H

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
    AT_SEQUENCE = 2,
    AT_RECORD_CRC16 = 6
};

#endif
