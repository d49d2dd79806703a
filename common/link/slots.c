#include "link/slots.h"

#include "link/bytes.h"
#include "link/crc.h"
#include "link/slot_layout.h"

/* 1 if wire[0..size-1] are all FF. */
static int all_erased(const uint8_t *wire, uint8_t size)
{
    while (size--) {
        if (*wire++ != 0xFFu)
            return 0;
    }
    return 1;
}

static void copy_text(char *to, const char *from, uint8_t size)
{
    uint8_t i;
    uint8_t ended = 0;

    for (i = 0; i < size; i++) {
        if (i == size - 1 || from[i] == '\0')
            ended = 1;
        to[i] = ended ? '\0' : from[i];
    }
}

void slot_header_encode(const slot_header_t *header, uint8_t wire[SLOT_HEADER_SIZE])
{
    be_put32(wire + AT_MAGIC, SLOT_HEADER_MAGIC);
    wire[AT_VERSION] = SLOT_HEADER_VERSION;
    wire[AT_FUNCTION] = header->function;
    be_put16(wire + AT_FUNCTION + 1, 0);
    be_put32(wire + AT_LENGTH, header->length);
    be_put32(wire + AT_CRC32, header->crc32);
    be_put32(wire + AT_GENERATION, header->generation);
    copy_text((char *)wire + AT_PART, header->part, SLOT_PART_SIZE);
    copy_text((char *)wire + AT_NAME, header->name, SLOT_NAME_SIZE);
    be_put16(wire + AT_NAME + SLOT_NAME_SIZE, 0);
    be_put16(wire + AT_CRC16, crc16_ccitt(CRC16_INIT, wire, AT_CRC16));
}

static slot_error_t header_check(const uint8_t wire[SLOT_HEADER_SIZE])
{
    if (all_erased(wire, SLOT_HEADER_SIZE))
        return SLOT_EMPTY;
    if (be_get32(wire + AT_MAGIC) != SLOT_HEADER_MAGIC ||
        be_get16(wire + AT_CRC16) != crc16_ccitt(CRC16_INIT, wire, AT_CRC16))
        return SLOT_BAD_HEADER;
    if (wire[AT_VERSION] != SLOT_HEADER_VERSION)
        return SLOT_BAD_VERSION;
    /* 0 wraps: one comparison for both ends of the range. */
    if (be_get32(wire + AT_LENGTH) - 1u >= BANK_HEADER_AT)
        return SLOT_BAD_LENGTH;
    return SLOT_OK;
}

slot_error_t slot_header_decode(const uint8_t wire[SLOT_HEADER_SIZE], slot_header_t *header)
{
    slot_error_t error = header_check(wire);

    if (error != SLOT_OK)
        return error;
    header->function = wire[AT_FUNCTION];
    header->length = be_get32(wire + AT_LENGTH);
    header->crc32 = be_get32(wire + AT_CRC32);
    header->generation = be_get32(wire + AT_GENERATION);
    copy_text(header->part, (const char *)wire + AT_PART, SLOT_PART_SIZE);
    copy_text(header->name, (const char *)wire + AT_NAME, SLOT_NAME_SIZE);
    return SLOT_OK;
}

void slot_record_encode(uint8_t kind, uint32_t sequence, uint8_t wire[SLOT_RECORD_SIZE])
{
    wire[0] = kind;
    wire[1] = 0;
    be_put32(wire + AT_SEQUENCE, sequence);
    be_put16(wire + AT_RECORD_CRC16, crc16_ccitt(CRC16_INIT, wire, AT_RECORD_CRC16));
}

uint8_t slot_record_decode(const uint8_t wire[SLOT_RECORD_SIZE], uint32_t *sequence)
{
    if (all_erased(wire, SLOT_RECORD_SIZE))
        return SLOT_RECORD_FREE;
    if (be_get16(wire + AT_RECORD_CRC16) != crc16_ccitt(CRC16_INIT, wire, AT_RECORD_CRC16))
        return 0;
    if (wire[0] != SLOT_RECORD_DEFAULT && wire[0] != SLOT_RECORD_GOLDEN)
        return 0;
    *sequence = be_get32(wire + AT_SEQUENCE);
    return wire[0];
}
