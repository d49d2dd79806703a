#include "link/slots.h"

#include "link/bytes.h"
#include "link/crc.h"
#include "link/slot_layout.h"

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

slot_error_t slot_header_decode(const uint8_t wire[SLOT_HEADER_SIZE], slot_header_t *header)
{
    slot_error_t error = slot_header_check(wire);

    if (error != SLOT_OK)
        return error;
    header->function = wire[AT_FUNCTION];
    header->length = slot_header_length(wire);
    header->crc32 = be_get32(wire + AT_CRC32);
    header->generation = slot_header_generation(wire);
    copy_text(header->part, (const char *)wire + AT_PART, SLOT_PART_SIZE);
    copy_text(header->name, (const char *)wire + AT_NAME, SLOT_NAME_SIZE);
    return SLOT_OK;
}
