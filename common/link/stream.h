/* The stream: how frames and their reports come out of bulk endpoint 86.
 *
 * A sequence of records, one for each frame of each eye, the left one of a pair first, and one at
 * the end. Each begins a USB packet:
 *
 *   frame  STREAM_BLOCK bytes, of which the first STREAM_HEADER_SIZE are the header and the rest 0,
 *          then the pixels row by row, two bytes each, high byte first: whole packets throughout
 *   end    STREAM_HEADER_SIZE bytes, the last packet of which is short at either speed
 *
 * A pair is sent whole or not at all. Pairs are numbered from 0 in each stream, lost ones too, so
 * that a receiver finds every loss by itself; the end record says what the FPGA has counted.
 * docs/SPEC.md section 7 owns the layout and gives golden bytes. */
#ifndef LINK_STREAM_H
#define LINK_STREAM_H

#include <stdint.h>

#include "link/registers.h"
#include "link/report.h"

#define STREAM_BLOCK       512u
#define STREAM_HEADER_SIZE 98u
#define STREAM_MAGIC       0x534F5446ul /* "SOTF" */
#define STREAM_VERSION     2u

/* Bytes of a header for the detectors' parameters, in the order of EYE_PARAMS; the rest are 0. */
#define STREAM_PARAMS_SIZE 32u

/* stream_header_t.kind */
#define STREAM_FRAME 1u
#define STREAM_END   2u

/* stream_header_t.eye */
#define STREAM_EYE_LEFT  0u
#define STREAM_EYE_RIGHT 1u

/* stream_header_t.pixels: how the pixels are coded */
#define STREAM_PIXELS_RGB565 0u

/* stream_header_t.flags */
#define STREAM_FLAG_TORN    0x01u /* a camera did not deliver all rows of this pair */
#define STREAM_FLAG_PATTERN 0x02u /* the test pattern, not a camera */
#define STREAM_FLAG_REPORT  0x04u /* the report was made from this pair; else it is all 0 */

typedef struct {
    uint8_t kind;         /* STREAM_FRAME, STREAM_END */
    uint8_t eye;          /* STREAM_EYE_* */
    uint8_t pixels;       /* STREAM_PIXELS_* */
    uint8_t flags;        /* STREAM_FLAG_* */
    uint16_t width_px;    /* 0 in the end record */
    uint16_t height_px;   /* 0 in the end record */
    uint32_t number;      /* of the pair in this stream; end record: how many there were */
    uint32_t sent;        /* pairs of lower numbers that are sent whole; end record: all */
    uint32_t lost;        /* pairs of lower numbers that are lost; end record: all */
    uint32_t exposure_us; /* middle of the exposure since configuration, wraps after 71 min */
    uint16_t session;     /* FPGA_REG_SESSION: tells this stream from those before */
    uint8_t report[REPORT_SIZE]; /* as the base gets it (link/report.h) */
    eye_params_t params;         /* those that the report was made with (link/registers.h) */
} stream_header_t;

typedef enum {
    STREAM_OK = 0,
    STREAM_NO_HEADER = -1,   /* no header here: bytes are missing, or it is another device */
    STREAM_BAD_CRC = -2,     /* a damaged header */
    STREAM_BAD_VERSION = -3, /* whole, but of a version or kind that this side does not know */
    STREAM_BAD_SIZE = -4     /* width, height or eye that no camera has */
} stream_error_t;

/* Largest frame, px. */
#define STREAM_WIDTH_MAX  640u
#define STREAM_HEIGHT_MAX 480u

/* Encode into wire[0..97]. */
void stream_header_encode(const stream_header_t *header, uint8_t wire[STREAM_HEADER_SIZE]);

/* Decode wire[0..97]. On any error *header is left as it was. */
stream_error_t stream_header_decode(const uint8_t wire[STREAM_HEADER_SIZE],
                                    stream_header_t *header);

/* The test pattern: pixel 0 of eye `eye` in pair `number`; each further one is higher by 1, with
 * wrap-around, so that any missing or doubled pixel shows. */
uint16_t stream_pattern_first(uint32_t number, uint8_t eye);

#endif
