#include "link/base_image.h"

#include "link/bytes.h"
#include "link/crc.h"

enum {
    AT_MAGIC = 0,
    AT_VERSION = 4,
    AT_LENGTH = 8,
    AT_LOAD = 12,
    AT_ENTRY = 16,
    AT_CRC32 = 20,
    AT_GENERATION = 24,
    AT_BUILD = 28,
    AT_RESERVED = 48,
    AT_CRC16 = 62
};

void base_image_encode(const base_image_t *image, uint8_t wire[BASE_IMAGE_HEADER_SIZE])
{
    uint8_t i;

    be_put32(wire + AT_MAGIC, BASE_IMAGE_MAGIC);
    be_put32(wire + AT_VERSION, (uint32_t)BASE_IMAGE_VERSION << 24);
    be_put32(wire + AT_LENGTH, image->length);
    be_put32(wire + AT_LOAD, image->load);
    be_put32(wire + AT_ENTRY, image->entry);
    be_put32(wire + AT_CRC32, image->crc32);
    be_put32(wire + AT_GENERATION, image->generation);
    for (i = 0; i < BASE_IMAGE_BUILD_SIZE; i++)
        wire[AT_BUILD + i] = image->build[i];
    for (i = AT_RESERVED; i < AT_CRC16; i++)
        wire[i] = 0;
    be_put16(wire + AT_CRC16, crc16_ccitt(CRC16_INIT, wire, AT_CRC16));
}

base_image_error_t base_image_decode(const uint8_t wire[BASE_IMAGE_HEADER_SIZE],
                                     base_image_t *image)
{
    uint8_t i;

    if (be_get32(wire + AT_MAGIC) != BASE_IMAGE_MAGIC ||
        be_get16(wire + AT_CRC16) != crc16_ccitt(CRC16_INIT, wire, AT_CRC16))
        return BASE_IMAGE_NONE;
    if (wire[AT_VERSION] != BASE_IMAGE_VERSION)
        return BASE_IMAGE_BAD_VERSION;
    image->length = be_get32(wire + AT_LENGTH);
    image->load = be_get32(wire + AT_LOAD);
    image->entry = be_get32(wire + AT_ENTRY);
    image->crc32 = be_get32(wire + AT_CRC32);
    image->generation = be_get32(wire + AT_GENERATION);
    for (i = 0; i < BASE_IMAGE_BUILD_SIZE; i++)
        image->build[i] = wire[AT_BUILD + i];
    return BASE_IMAGE_OK;
}
