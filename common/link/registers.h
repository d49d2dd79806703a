/* The FPGA's register file: 8-bit addresses 00..7F, 16-bit values.
 *
 * The FX2 reaches it over SPI, the 68331 in the words it sends while it clocks a report out.
 * docs/SPEC.md section 2 owns the framings and gives golden bytes. */
#ifndef LINK_REGISTERS_H
#define LINK_REGISTERS_H

#include <stdint.h>

/* address                reset   meaning */
#define FPGA_REG_ID            0x00u /* ro: FPGA_ID_VALUE once configured */
#define FPGA_REG_FUNCTION      0x01u /* ro: FPGA_FUNCTION_* (link/report.h) */
#define FPGA_REG_STREAM        0x02u /* rw, 0: FPGA_STREAM_*; written by the FX2 only */
#define FPGA_REG_FRAME_COUNT   0x03u /* ro: frames taken since configuration, wraps */
#define FPGA_REG_GOAL_ROW      0x04u /* rw, 60: row of the goal's epipolar line, 4..235 */
#define FPGA_REG_OPPONENT_ROW  0x05u /* rw, 80: row of the opponent's epipolar line, 4..235 */
#define FPGA_REG_SEARCH_MAX    0x06u /* rw, 79: largest disparity searched, 16..127 px */
#define FPGA_REG_FRAME_RATE    0x07u /* rw, 40: frames per second, 1..40 */
#define FPGA_REG_FORMAT        0x08u /* rw, 0: FPGA_FORMAT_*: what the cameras send */
#define FPGA_REG_SOURCE        0x09u /* rw, 0: FPGA_SOURCE_*: what is streamed */
#define FPGA_REG_YELLOW_MARGIN 0x0Au /* rw, 26: how yellow a ball is at least, 0..255 */
#define FPGA_REG_SESSION       0x0Bu /* ro: streams begun since configuration, wraps */
#define FPGA_REG_SENT          0x0Cu /* ro: pairs sent whole in this stream, wraps */
#define FPGA_REG_LOST          0x0Du /* ro: pairs lost in this stream, wraps */
#define FPGA_REG_EYES          0x0Eu /* ro: FPGA_EYES_*: how the cameras are */
#define FPGA_REG_TORN          0x0Fu /* ro: pairs with a torn frame since configuration, wraps */
#define FPGA_REG_CAMERA_TABLE  0x40u /* rw, 40..5F for format 0, 60..7F for format 1; see below */
#define FPGA_REG_COUNT         0x80u

#define FPGA_ID_VALUE 0x5301u /* 'S', register map 1 */

/* FPGA_REG_STREAM. Written END, it goes to OFF by itself when all is sent. */
#define FPGA_STREAM_OFF 0u /* FD[15:0] floats; what was not sent is forgotten */
#define FPGA_STREAM_ON  1u /* a stream begins: FD is driven, all its counters are 0 */
#define FPGA_STREAM_END 2u /* no new pairs; those taken are sent, then the end record */

/* FPGA_REG_FORMAT */
#define FPGA_FORMAT_320X240 0u
#define FPGA_FORMAT_640X480 1u /* the detectors see the mean of each 2x2 pixels */
#define FPGA_FORMAT_COUNT   2u

/* FPGA_REG_SOURCE */
#define FPGA_SOURCE_CAMERAS 0u
#define FPGA_SOURCE_PATTERN                                                                        \
    1u /* link/stream.h, as fast as USB takes it; function `capture` only                          \
        */

/* FPGA_REG_EYES: bits for the left eye; for the right one shifted up by FPGA_EYES_RIGHT_SHIFT. */
#define FPGA_EYES_ALIVE       0x01u /* a frame has ended within the last 250 ms */
#define FPGA_EYES_TORN        0x02u /* the last one had not the rows and columns of FPGA_REG_FORMAT */
#define FPGA_EYES_RIGHT_SHIFT 8u

/* The cameras' tables: part of the design, so that a bitstream brings the settings it was made for.
 * Each entry is register << 8 | value, sent to both cameras in this order after their reset;
 * FPGA_CAMERA_TABLE_END ends a table that does not fill its place. */
#define FPGA_CAMERA_TABLE_ENTRIES 0x20u
#define FPGA_CAMERA_TABLE_END     0xFFFFu

/* SPI (mode 0, most significant bit first, SS# low for the whole of it): one address byte, then two
 * value bytes. Bit 7 of the address set = write; else the value is read. */
#define FPGA_SPI_WRITE 0x80u
#define FPGA_SPI_BYTES 3u

/* A write by the base: words 0..2 of the 16 it sends while it clocks a report out:
 * REGISTER_WORD_WRITE | address, value, CRC-16/CCITT-FALSE over those four bytes.
 * A first word without REGISTER_WORD_WRITE, or a wrong CRC, changes nothing. */
#define REGISTER_WORD_WRITE  0x8000u
#define REGISTER_WRITE_BYTES 6u

/* A read by the base: a transfer of three words, the first REGISTER_WORD_READ | address. The FPGA
 * answers in words 1 and 2: value, CRC-16/CCITT-FALSE over the first word sent and the value. A
 * report that waits goes on waiting. */
#define REGISTER_WORD_READ  0x4000u
#define REGISTER_READ_BYTES 6u

/* Encode a write into wire[0..5]. Address 00..7F. May be called from an interrupt. */
void register_write_encode(uint8_t address, uint16_t value, uint8_t wire[REGISTER_WRITE_BYTES]);

/* Decode wire[0..5]. Returns 1 and fills both, or 0 (no write, or a damaged one) and fills none. */
int register_write_decode(const uint8_t wire[REGISTER_WRITE_BYTES], uint8_t *address,
                          uint16_t *value);

/* The answer to a read of `address`: wire[0..1] are the word that was sent, wire[2..5] what the
 * FPGA answers. May be called from an interrupt. */
void register_read_encode(uint8_t address, uint16_t value, uint8_t wire[REGISTER_READ_BYTES]);

/* Check wire[0..5], put together likewise: returns 1 and fills *value, or 0 (damaged, or nobody
 * there) and leaves it. */
int register_read_decode(const uint8_t wire[REGISTER_READ_BYTES], uint16_t *value);

#endif
