/* What PC and resident loader of the Khepera base say to each other over the serial line.
 *
 * Every request receives exactly one reply, with the request's sequence number and its type plus
 * LOADER_REPLY; a reply's first byte is a status. The PC asks again when no reply comes: every
 * request may be obeyed twice. A frame on the wire:
 *
 *   00  COBS( type, sequence, payload..., CRC-16 of all that )  00
 *
 * COBS (consistent overhead byte stuffing) takes the zeros out, so that a zero always ends a frame:
 * whatever noise does to one frame, the next one is found. A damaged frame is dropped without a
 * word. 8N1; docs/SPEC.md lists the requests and gives golden bytes.
 *
 * Nothing here may be called for one receiver from two places at once. */
#ifndef LINK_LOADER_H
#define LINK_LOADER_H

#include <stdint.h>

#include "link/base_image.h"

#define LOADER_PROTOCOL    1u
#define LOADER_BLOCK_SIZE  256u
#define LOADER_PAYLOAD_MAX (4u + LOADER_BLOCK_SIZE)
#define LOADER_FRAME_MAX   (2u + LOADER_PAYLOAD_MAX + 2u)
/* COBS adds one byte for each 254; a zero before and one after. */
#define LOADER_WIRE_MAX    (LOADER_FRAME_MAX + LOADER_FRAME_MAX / 254u + 1u + 2u)

#define LOADER_REPLY 0x80u

/* Requests; payload -> payload of the reply after its status. Blocks and sectors are counted from
 * the bank's start; only the bank that is not active can be changed. */
#define LOADER_HELLO  0x01u /* -> loader_hello_t */
#define LOADER_SUMS   0x02u /* u8 bank, u16 first, u8 count 1..LOADER_SUMS_MAX -> u32 CRC-32 each */
#define LOADER_ERASE  0x03u /* u8 sector of the bank */
#define LOADER_WRITE  0x04u /* u16 block 1.., LOADER_BLOCK_SIZE bytes; into erased flash */
#define LOADER_COPY   0x05u /* u16 block 1..: from the active bank, into erased flash */
#define LOADER_COMMIT 0x06u /* image header: checked against what was written, then valid */
#define LOADER_RUN    0x07u /* reply, then reset */
#define LOADER_SPEED                                                                               \
    0x08u /* u32 baud: reply, then change; back to the start if nothing is heard                   \
           */

#define LOADER_SUMS_MAX 64u

/* Status of a reply. */
#define LOADER_OK           0u
#define LOADER_UNKNOWN      1u /* no such request */
#define LOADER_BAD_SIZE     2u /* the payload's length does not fit the request */
#define LOADER_OUT_OF_RANGE 3u /* no such bank, block, sector or rate */
#define LOADER_FLASH_FAILED 4u /* the flash does not do what it was told, or was not erased */
#define LOADER_NOT_ACTIVE   5u /* there is no active bank to copy from */
#define LOADER_BAD_HEADER   6u /* not an image header, or one that does not fit this base */
#define LOADER_BAD_IMAGE    7u /* the bank's contents are not what the header says */

/* Why the loader and not a program is running. */
#define LOADER_WHY_ASKED    0u /* the program was told to enter it */
#define LOADER_WHY_NO_IMAGE 1u /* neither bank holds a whole image */
#define LOADER_WHY_HELLO    2u /* a HELLO came while it checked the image */

#define LOADER_NO_BANK    0xFFu
#define LOADER_HELLO_SIZE 48u

/* Answer to HELLO. */
typedef struct {
    uint8_t protocol;
    uint8_t why;
    uint8_t active;  /* bank that would start: 0, 1 or LOADER_NO_BANK */
    uint8_t sectors; /* of a bank */
    uint32_t bank_size;
    uint32_t ram_first, ram_end; /* where a program may lie: ram_first..ram_end-1 */
    /* Of the active bank's image; 0 without one. */
    uint32_t length;
    uint32_t crc32;
    uint32_t generation;
    uint8_t build[BASE_IMAGE_BUILD_SIZE];
} loader_hello_t;

void loader_hello_encode(const loader_hello_t *hello, uint8_t wire[LOADER_HELLO_SIZE]);
void loader_hello_decode(const uint8_t wire[LOADER_HELLO_SIZE], loader_hello_t *hello);

/* The frame's bytes on the wire, both zeros included; returns how many. size <=
 * LOADER_PAYLOAD_MAX; payload may be NULL if size is 0. */
uint16_t loader_frame_encode(uint8_t type, uint8_t sequence, const uint8_t *payload, uint16_t size,
                             uint8_t wire[LOADER_WIRE_MAX]);

/* Takes a frame together, character by character. */
typedef struct {
    uint8_t frame[LOADER_FRAME_MAX]; /* type, sequence, payload, CRC */
    uint16_t count;                  /* bytes in frame[] */
    uint8_t run;                     /* bytes until COBS's next length byte; 0 = it comes now */
    uint8_t zero;                    /* a zero goes before the next run */
    uint8_t broken;                  /* too long: wait for the end */
} loader_receiver_t;

void loader_receiver_init(loader_receiver_t *receiver);

/* The next character. Returns 1 if it ended a whole frame: type frame[0], sequence frame[1],
 * payload frame[2..] of *size bytes, valid until the next call; else 0. */
uint8_t loader_receive(loader_receiver_t *receiver, uint8_t character, uint16_t *size);

#endif
