/* What remains of a crash: a record in RAM that neither reset nor start-up clears.
 *
 * An unexpected exception turns the motors off, fills the record and lets the watchdog reset the
 * chip (board/crt0.S). The console shows the record after the restart. */
#ifndef BOARD_CRASH_H
#define BOARD_CRASH_H

/* What unused stack is filled with, to find its high-water mark. */
#define STACK_PAINT 0x5AFE57AC

#ifndef __ASSEMBLER__
#include <stdint.h>

#define CRASH_FRAME_WORDS 12u /* the longest frame of a CPU32 */
#define BUILD_ID_BYTES    20u

typedef struct {
    uint32_t magic;
    uint32_t registers[16]; /* D0..D7, A0..A7 at the exception */
    /* The exception frame as the CPU stacked it: SR, PC (two words), format and vector offset... */
    uint16_t frame[CRASH_FRAME_WORDS];
    uint8_t build_id[BUILD_ID_BYTES]; /* of the image that crashed */
    uint16_t crc;                     /* CRC-16 of all before */
} crash_record_t;

/* Called by crash_entry only, with the exception frame's address. */
void crash_save(const uint16_t *frame);

/* The record of the last crash, or NULL if there is none (or RAM lost its supply meanwhile). */
const crash_record_t *crash_last(void);

/* Forget it. */
void crash_clear(void);

/* Vector number of a record: 2 bus error, 3 address error, 4 illegal instruction... */
static inline uint8_t crash_vector(const crash_record_t *record)
{
    return (uint8_t)((record->frame[3] & 0x0FFFu) / 4u);
}

/* The program counter of a record. */
static inline uint32_t crash_pc(const crash_record_t *record)
{
    return (uint32_t)record->frame[1] << 16 | record->frame[2];
}

/* The image's build id: SHA-1 of its contents, BUILD_ID_BYTES bytes. */
const uint8_t *build_id(void);

/* Deepest use of the stack so far, bytes. Walks the unused part: some 10 us per KiB. */
uint32_t stack_high_water(void);
/* Bytes that it may take. */
uint32_t stack_capacity(void);
#endif

#endif
