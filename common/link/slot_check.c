#include "link/bytes.h"
#include "link/crc.h"
#include "link/slot_layout.h"
#include "link/slots.h"

uint8_t slot_all_erased(const uint8_t *wire, uint8_t size)
{
    while (size--) {
        if (*wire++ != 0xFFu)
            return 0;
    }
    return 1;
}

uint32_t slot_header_length(const uint8_t wire[SLOT_HEADER_SIZE])
{
    return be_get32(wire + AT_LENGTH);
}

uint32_t slot_header_generation(const uint8_t wire[SLOT_HEADER_SIZE])
{
    return be_get32(wire + AT_GENERATION);
}

slot_error_t slot_header_check(const uint8_t wire[SLOT_HEADER_SIZE])
{
    if (slot_all_erased(wire, SLOT_HEADER_SIZE))
        return SLOT_EMPTY;
    if (be_get32(wire + AT_MAGIC) != SLOT_HEADER_MAGIC ||
        be_get16(wire + AT_CRC16) != crc16_ccitt(CRC16_INIT, wire, AT_CRC16))
        return SLOT_BAD_HEADER;
    if (wire[AT_VERSION] != SLOT_HEADER_VERSION)
        return SLOT_BAD_VERSION;
    /* 0 wraps: one comparison for both ends of the range. */
    if (slot_header_length(wire) - 1u >= BANK_HEADER_AT)
        return SLOT_BAD_LENGTH;
    return SLOT_OK;
}

uint8_t slot_record_decode(const uint8_t wire[SLOT_RECORD_SIZE], uint32_t *sequence)
{
    if (slot_all_erased(wire, SLOT_RECORD_SIZE))
        return SLOT_RECORD_FREE;
    if (be_get16(wire + 6) != crc16_ccitt(CRC16_INIT, wire, 6))
        return 0;
    if (wire[0] != SLOT_RECORD_DEFAULT && wire[0] != SLOT_RECORD_GOLDEN)
        return 0;
    *sequence = be_get32(wire + 2);
    return wire[0];
}
