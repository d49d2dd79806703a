/* Images of the Khepera base: how a program lies in one of the two image banks of its flash.
 *
 *   bank + 0x00  header (64 bytes)
 *   bank + 0x40  commit word (4 bytes), programmed last: without it the bank is not there
 *   bank + 0x100 the program, `length` bytes, as it shall lie in RAM from `load` on
 *
 * The loader starts the whole image with the higher generation; a write goes to the other bank, so
 * that a power cut never costs the good one. All integers big-endian. docs/SPEC.md owns the layout
 * and gives golden bytes. */
#ifndef LINK_BASE_IMAGE_H
#define LINK_BASE_IMAGE_H

#include <stdint.h>

#define BASE_IMAGE_MAGIC       0x42415345ul /* "BASE" */
#define BASE_IMAGE_VERSION     1u
#define BASE_IMAGE_HEADER_SIZE 64u
#define BASE_IMAGE_COMMIT_AT   64u
#define BASE_IMAGE_COMMIT_WORD 0x434F4D54ul /* "COMT" */
#define BASE_IMAGE_COMMIT_SIZE 4u
#define BASE_IMAGE_PROGRAM_AT  256u
#define BASE_IMAGE_BUILD_SIZE  20u

typedef struct {
    uint32_t length;                      /* bytes of program, 1.. */
    uint32_t load;                        /* where it shall lie in RAM, even */
    uint32_t entry;                       /* where it starts, even, within it */
    uint32_t crc32;                       /* CRC-32 of the program */
    uint32_t generation;                  /* the whole image with the higher one counts */
    uint8_t build[BASE_IMAGE_BUILD_SIZE]; /* build id, informative */
} base_image_t;

typedef enum {
    BASE_IMAGE_OK = 0,
    BASE_IMAGE_NONE = -1,       /* magic or check sum wrong: none here, or not wholly written */
    BASE_IMAGE_BAD_VERSION = -2 /* whole, but of a version this side does not know */
} base_image_error_t;

/* Encode into wire[0..63]. */
void base_image_encode(const base_image_t *image, uint8_t wire[BASE_IMAGE_HEADER_SIZE]);

/* Decode wire[0..63]. On an error *image is left as it was. Addresses and length are not judged:
 * what fits is for the reader to say. */
base_image_error_t base_image_decode(const uint8_t wire[BASE_IMAGE_HEADER_SIZE],
                                     base_image_t *image);

#endif
