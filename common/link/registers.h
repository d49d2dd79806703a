/* The FPGA's register file: 8-bit addresses 00..7F, 16-bit values.
 *
 * The FX2 reaches it over SPI, the 68331 in the words it sends while it clocks a report out.
 * docs/SPEC.md section 2 owns the framings and gives golden bytes. */
#ifndef LINK_REGISTERS_H
#define LINK_REGISTERS_H

#include <stdint.h>

#define FPGA_REG_ID            0x00u
#define FPGA_REG_FUNCTION      0x01u
#define FPGA_REG_STREAM        0x02u
#define FPGA_REG_FRAME_COUNT   0x03u
#define FPGA_REG_GOAL_ROW      0x04u
#define FPGA_REG_OPPONENT_ROW  0x05u
#define FPGA_REG_SEARCH_MAX    0x06u
#define FPGA_REG_FRAME_RATE    0x07u
#define FPGA_REG_FORMAT        0x08u
#define FPGA_REG_SOURCE        0x09u
#define FPGA_REG_YELLOW_MARGIN 0x0Au
#define FPGA_REG_SESSION       0x0Bu
#define FPGA_REG_SENT          0x0Cu
#define FPGA_REG_LOST          0x0Du
#define FPGA_REG_EYES          0x0Eu
#define FPGA_REG_TORN          0x0Fu
#define FPGA_REG_PARAMS        0x10u /* 10..20: more parameters of the detectors, see below */
#define FPGA_REG_CAMERA_TABLE  0x40u /* 40..5F for format 0, 60..7F for format 1; see below */
#define FPGA_REG_COUNT         0x80u

/* Every register with a name, by rising address.
 *
 * FPGA_REGISTERS(X, P) expands X(address, name, unit, reset, min, max, text) once for each register
 * of the design and P(...) once for each parameter of its detectors. `reset` is the value after
 * configuration; a write takes min to max, both included; where min is above max it can only be
 * read. Parameters are bytes, and a change takes effect with the next pair of frames. What the
 * kernels in vision/ compute with, the bytes in a streamed header (link/stream.h), the FPGA's model
 * and the tables of both shells are all expanded from this list. */
/* clang-format off */
#define FPGA_REGISTERS(X, P) \
    X(FPGA_REG_ID, id, "", FPGA_ID_VALUE, 1, 0, "identity and version of this list") \
    X(FPGA_REG_FUNCTION, function, "", 0, 1, 0, "1 soccer, 2 capture") \
    X(FPGA_REG_STREAM, stream, "", 0, 0, 2, "0 off, 1 on, 2 ending; written by the FX2 only") \
    X(FPGA_REG_FRAME_COUNT, frames, "pairs", 0, 1, 0, "taken since configuration, wraps") \
    P(FPGA_REG_GOAL_ROW, goal_row, "row", 60, 4, 235, "epipolar line of the goal") \
    P(FPGA_REG_OPPONENT_ROW, opponent_row, "row", 80, 4, 235, "epipolar line of the opponent") \
    P(FPGA_REG_SEARCH_MAX, search_max, "px", 79, 16, 127, "largest disparity searched") \
    X(FPGA_REG_FRAME_RATE, frame_rate, "1/s", 40, 1, 40, "frames a second, at 640x480 at most 30") \
    X(FPGA_REG_FORMAT, format, "", 0, 0, 1, "of the cameras: 0 320x240, 1 640x480") \
    X(FPGA_REG_SOURCE, source, "", 0, 0, 1, "streamed: 0 cameras, 1 pattern (capture only)") \
    P(FPGA_REG_YELLOW_MARGIN, yellow_margin, "1/255", 26, 0, 255, "ball: red + green - 3 blue, more than") \
    X(FPGA_REG_SESSION, session, "streams", 0, 1, 0, "begun since configuration, wraps") \
    X(FPGA_REG_SENT, sent, "pairs", 0, 1, 0, "of the stream sent whole, wraps") \
    X(FPGA_REG_LOST, lost, "pairs", 0, 1, 0, "of the stream lost, wraps") \
    X(FPGA_REG_EYES, eyes, "", 0, 1, 0, "bit 0 left alive, 1 left torn, 8 right alive, 9 right torn") \
    X(FPGA_REG_TORN, torn, "pairs", 0, 1, 0, "torn by a camera since configuration, wraps") \
    P(FPGA_REG_PARAMS + 0u, yellow_red, "%", 80, 0, 200, "ball: red, of the green, more than") \
    P(FPGA_REG_PARAMS + 1u, yellow_green, "%", 60, 0, 200, "ball: green, of the red, more than") \
    P(FPGA_REG_PARAMS + 2u, pitch_margin, "1/255", 8, 0, 255, "pitch: green - red, more than") \
    P(FPGA_REG_PARAMS + 3u, strip_min, "px", 5, 1, 64, "ball: shortest yellow strip of a row") \
    P(FPGA_REG_PARAMS + 4u, strip_gap, "px", 3, 0, 64, "ball: gaps in a strip that are closed") \
    P(FPGA_REG_PARAMS + 5u, ball_min, "px", 9, 2, 120, "ball: smallest width and height") \
    P(FPGA_REG_PARAMS + 6u, ball_rows, "rows", 4, 0, 60, "ball: most that the eyes may be apart") \
    P(FPGA_REG_PARAMS + 7u, edge_min, "1/255", 12, 1, 127, "smallest step of an edge, over two pixels") \
    P(FPGA_REG_PARAMS + 8u, match_rows, "rows", 2, 0, 2, "goal: blocks are searched so far up and down") \
    P(FPGA_REG_PARAMS + 9u, goal_black, "1/256", 96, 1, 255, "goal: brightest black, of the wall") \
    P(FPGA_REG_PARAMS + 10u, goal_min, "px", 16, 4, 160, "goal: shortest run of black") \
    P(FPGA_REG_PARAMS + 11u, goal_wall, "px", 5, 1, 64, "goal: shortest wall beside it") \
    P(FPGA_REG_PARAMS + 12u, goal_slack, "%", 25, 0, 100, "goal: most that its width may be off") \
    P(FPGA_REG_PARAMS + 13u, stripe_black, "1/256", 128, 1, 255, "opponent: brightest black, of the white") \
    P(FPGA_REG_PARAMS + 14u, stripe_edges, "edges", 4, 3, 16, "opponent: fewest of its stripes") \
    P(FPGA_REG_PARAMS + 15u, stripe_max, "mm", 14, 4, 60, "opponent: widest stripe") \
    P(FPGA_REG_PARAMS + 16u, wall_rows, "rows", 4, 1, 60, "wall: fewest of it, and of pitch below")
/* clang-format on */

#define FPGA_REGISTER_SKIP(address, name, unit, reset, min, max, text)
#define FPGA_REGISTER_ONE(address, name, unit, reset, min, max, text) +1

/* The list's parameters alone. */
#define EYE_PARAMS(P)       FPGA_REGISTERS(FPGA_REGISTER_SKIP, P)
#define EYE_PARAM_COUNT     (0 EYE_PARAMS(FPGA_REGISTER_ONE))
#define FPGA_REGISTER_COUNT (0 FPGA_REGISTERS(FPGA_REGISTER_ONE, FPGA_REGISTER_ONE))

typedef struct {
#define EYE_PARAM_FIELD(address, name, unit, reset, min, max, text) uint8_t name;
    EYE_PARAMS(EYE_PARAM_FIELD)
#undef EYE_PARAM_FIELD
} eye_params_t;

extern const eye_params_t eye_params_default;

/* The parameters in the order of the list, as their registers and a streamed header hold them. */
void eye_params_encode(const eye_params_t *params, uint8_t bytes[EYE_PARAM_COUNT]);
void eye_params_decode(const uint8_t bytes[EYE_PARAM_COUNT], eye_params_t *params);

/* Take each parameter that is out of range as the nearest value in range. */
void eye_params_clamp(eye_params_t *params);

/* A register as a shell wants it. */
typedef struct {
    uint8_t address;
    uint8_t is_param; /* one of EYE_PARAMS */
    const char *name;
    const char *unit; /* "" for none */
    const char *text;
    uint16_t reset;
    uint16_t min; /* above max: it can only be read */
    uint16_t max;
} fpga_register_t;

/* FPGA_REGISTERS as a table. */
extern const fpga_register_t fpga_registers[FPGA_REGISTER_COUNT];

/* The register of that name, or 0. */
const fpga_register_t *fpga_register_find(const char *name);

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
