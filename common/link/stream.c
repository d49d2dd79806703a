#include "link/stream.h"

#include "link/bytes.h"
#include "link/crc.h"

/* Offsets of the wire format; docs/SPEC.md section 7. */
enum {
    AT_MAGIC = 0,
    AT_VERSION = 4,
    AT_KIND = 5,
    AT_EYE = 6,
    AT_PIXELS = 7,
    AT_WIDTH = 8,
    AT_HEIGHT = 10,
    AT_NUMBER = 12,
    AT_SENT = 16,
    AT_LOST = 20,
    AT_EXPOSURE = 24,
    AT_SESSION = 28,
    AT_FLAGS = 30,
    AT_RESERVED = 31,
    AT_REPORT = 32,
    AT_PARAMS = 64,
    AT_CRC = 96
};

/* All parameters have a place: a negative array size stops the compiler otherwise. */
typedef char params_fit_a_header[EYE_PARAM_COUNT <= STREAM_PARAMS_SIZE ? 1 : -1];

static void copy(uint8_t *to, const uint8_t *from, uint8_t size)
{
    while (size--)
        *to++ = *from++;
}

void stream_header_encode(const stream_header_t *header, uint8_t wire[STREAM_HEADER_SIZE])
{
    uint8_t i;

    be_put32(wire + AT_MAGIC, STREAM_MAGIC);
    wire[AT_VERSION] = STREAM_VERSION;
    wire[AT_KIND] = header->kind;
    wire[AT_EYE] = header->eye;
    wire[AT_PIXELS] = header->pixels;
    be_put16(wire + AT_WIDTH, header->width_px);
    be_put16(wire + AT_HEIGHT, header->height_px);
    be_put32(wire + AT_NUMBER, header->number);
    be_put32(wire + AT_SENT, header->sent);
    be_put32(wire + AT_LOST, header->lost);
    be_put32(wire + AT_EXPOSURE, header->exposure_us);
    be_put16(wire + AT_SESSION, header->session);
    wire[AT_FLAGS] = header->flags;
    wire[AT_RESERVED] = 0;
    copy(wire + AT_REPORT, header->report, REPORT_SIZE);
    for (i = EYE_PARAM_COUNT; i < STREAM_PARAMS_SIZE; i++)
        wire[AT_PARAMS + i] = 0;
    eye_params_encode(&header->params, wire + AT_PARAMS);
    be_put16(wire + AT_CRC, crc16_ccitt(CRC16_INIT, wire, AT_CRC));
}

static int is_frame(const uint8_t *wire)
{
    uint16_t width = be_get16(wire + AT_WIDTH);
    uint16_t height = be_get16(wire + AT_HEIGHT);

    /* Whole packets, at either speed: 256 pixels. */
    return wire[AT_EYE] <= STREAM_EYE_RIGHT && width >= 1u && width <= STREAM_WIDTH_MAX &&
           height >= 1u && height <= STREAM_HEIGHT_MAX &&
           ((uint32_t)width * height) % (STREAM_BLOCK / 2u) == 0;
}

static stream_error_t check(const uint8_t *wire)
{
    if (be_get32(wire + AT_MAGIC) != STREAM_MAGIC)
        return STREAM_NO_HEADER;
    if (be_get16(wire + AT_CRC) != crc16_ccitt(CRC16_INIT, wire, AT_CRC))
        return STREAM_BAD_CRC;
    if (wire[AT_VERSION] != STREAM_VERSION || wire[AT_PIXELS] != STREAM_PIXELS_RGB565)
        return STREAM_BAD_VERSION;
    if (wire[AT_KIND] == STREAM_END)
        return STREAM_OK;
    if (wire[AT_KIND] != STREAM_FRAME)
        return STREAM_BAD_VERSION;
    return is_frame(wire) ? STREAM_OK : STREAM_BAD_SIZE;
}

stream_error_t stream_header_decode(const uint8_t wire[STREAM_HEADER_SIZE], stream_header_t *header)
{
    stream_error_t error = check(wire);

    if (error != STREAM_OK)
        return error;
    header->kind = wire[AT_KIND];
    header->eye = wire[AT_EYE];
    header->pixels = wire[AT_PIXELS];
    header->flags = wire[AT_FLAGS];
    header->width_px = be_get16(wire + AT_WIDTH);
    header->height_px = be_get16(wire + AT_HEIGHT);
    header->number = be_get32(wire + AT_NUMBER);
    header->sent = be_get32(wire + AT_SENT);
    header->lost = be_get32(wire + AT_LOST);
    header->exposure_us = be_get32(wire + AT_EXPOSURE);
    header->session = be_get16(wire + AT_SESSION);
    copy(header->report, wire + AT_REPORT, REPORT_SIZE);
    eye_params_decode(wire + AT_PARAMS, &header->params);
    return STREAM_OK;
}

uint16_t stream_pattern_first(uint32_t number, uint8_t eye)
{
    /* Odd and far from a power of two: neighbouring pairs and eyes begin far apart. */
    return (uint16_t)((uint16_t)number * 40503u + (eye ? 0x5A5Au : 0u));
}
