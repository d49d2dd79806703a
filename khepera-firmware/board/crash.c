#include "board/crash.h"

#include <stddef.h>

#include "link/crc.h"

#define CRASH_MAGIC       0x43525348ul /* "CRSH" */
/* An ELF note: name size, description size, type, then the name "GNU\0". */
#define NOTE_HEADER_BYTES 16u

extern uint32_t stack_bottom[];
extern uint32_t stack_top[];
extern const uint8_t build_id_note[];

static crash_record_t record __attribute__((section(".noinit")));
uint32_t crash_registers[16] __attribute__((section(".noinit")));

static uint16_t record_crc(void)
{
    return crc16_ccitt(CRC16_INIT, (const uint8_t *)&record, offsetof(crash_record_t, crc));
}

void crash_save(const uint16_t *frame)
{
    unsigned i;

    for (i = 0; i < 16; i++)
        record.registers[i] = crash_registers[i];
    /* A frame may end with the stack: do not read beyond it and fault again. */
    for (i = 0; i < CRASH_FRAME_WORDS; i++)
        record.frame[i] = (uintptr_t)&frame[i] < (uintptr_t)stack_top ? frame[i] : 0;
    for (i = 0; i < BUILD_ID_BYTES; i++)
        record.build_id[i] = build_id()[i];
    record.magic = CRASH_MAGIC;
    record.crc = record_crc();
}

const crash_record_t *crash_last(void)
{
    return record.magic == CRASH_MAGIC && record.crc == record_crc() ? &record : NULL;
}

void crash_clear(void)
{
    record.magic = 0;
}

const uint8_t *build_id(void)
{
    return build_id_note + NOTE_HEADER_BYTES;
}

uint32_t stack_capacity(void)
{
    return (uint32_t)((uintptr_t)stack_top - (uintptr_t)stack_bottom);
}

uint32_t stack_high_water(void)
{
    uintptr_t at = (uintptr_t)stack_bottom;
    uintptr_t top = (uintptr_t)stack_top;

    while (at < top && *(const uint32_t *)at == STACK_PAINT)
        at += sizeof(uint32_t);
    return (uint32_t)(top - at);
}
