#include "link/loader.h"

#include "link/bytes.h"
#include "link/crc.h"

#define HEAD_SIZE 2u
#define CRC_SIZE  2u
/* The length byte of a COBS run that no implied zero follows. */
#define RUN_MAX   0xFFu

/* COBS on its way out: the length byte of a run is known at its end. */
typedef struct {
    uint8_t *length; /* where it goes */
    uint8_t *next;
    uint8_t run; /* what goes there: itself and the bytes after it */
} stuffer_t;

static void stuff_begin(stuffer_t *stuffer)
{
    stuffer->length = stuffer->next++;
    stuffer->run = 1;
}

static void stuff(stuffer_t *stuffer, uint8_t byte)
{
    if (byte != 0) {
        *stuffer->next++ = byte;
        stuffer->run++;
    }
    if (byte == 0 || stuffer->run == RUN_MAX) {
        *stuffer->length = stuffer->run;
        stuff_begin(stuffer);
    }
}

uint16_t loader_frame_encode(uint8_t type, uint8_t sequence, const uint8_t *payload, uint16_t size,
                             uint8_t wire[LOADER_WIRE_MAX])
{
    stuffer_t stuffer;
    uint8_t head[HEAD_SIZE];
    uint16_t crc;
    uint16_t i;

    head[0] = type;
    head[1] = sequence;
    crc = crc16_ccitt(CRC16_INIT, head, HEAD_SIZE);
    crc = crc16_ccitt(crc, payload, size);

    *wire = 0;
    stuffer.next = wire + 1;
    stuff_begin(&stuffer);
    for (i = 0; i < HEAD_SIZE; i++)
        stuff(&stuffer, head[i]);
    for (i = 0; i < size; i++)
        stuff(&stuffer, payload[i]);
    stuff(&stuffer, (uint8_t)(crc >> 8));
    stuff(&stuffer, (uint8_t)crc);
    *stuffer.length = stuffer.run;
    *stuffer.next++ = 0;
    return (uint16_t)(stuffer.next - wire);
}

void loader_receiver_init(loader_receiver_t *receiver)
{
    receiver->count = 0;
    receiver->run = 0;
    receiver->zero = 0;
    receiver->broken = 0;
}

static void append(loader_receiver_t *receiver, uint8_t byte)
{
    if (receiver->count == LOADER_FRAME_MAX)
        receiver->broken = 1;
    else
        receiver->frame[receiver->count++] = byte;
}

static uint8_t end_of_frame(loader_receiver_t *receiver, uint16_t *size)
{
    uint16_t covered = receiver->count;
    uint8_t whole = !receiver->broken && receiver->run == 0 && covered >= HEAD_SIZE + CRC_SIZE;
    uint16_t crc;

    loader_receiver_init(receiver);
    if (!whole)
        return 0;
    covered = (uint16_t)(covered - CRC_SIZE);
    crc = crc16_ccitt(CRC16_INIT, receiver->frame, covered);
    if (be_get16(receiver->frame + covered) != crc)
        return 0;
    *size = (uint16_t)(covered - HEAD_SIZE);
    return 1;
}

uint8_t loader_receive(loader_receiver_t *receiver, uint8_t character, uint16_t *size)
{
    if (character == 0)
        return end_of_frame(receiver, size);
    if (receiver->run > 0) {
        append(receiver, character);
        receiver->run--;
        return 0;
    }
    /* A length byte: the zero that the run before stands for is part of the frame only now. */
    if (receiver->zero)
        append(receiver, 0);
    receiver->run = (uint8_t)(character - 1);
    receiver->zero = character != RUN_MAX;
    return 0;
}

void loader_hello_encode(const loader_hello_t *hello, uint8_t wire[LOADER_HELLO_SIZE])
{
    uint8_t i;

    wire[0] = hello->protocol;
    wire[1] = hello->why;
    wire[2] = hello->active;
    wire[3] = hello->sectors;
    be_put32(wire + 4, hello->bank_size);
    be_put32(wire + 8, hello->ram_first);
    be_put32(wire + 12, hello->ram_end);
    be_put32(wire + 16, hello->length);
    be_put32(wire + 20, hello->crc32);
    be_put32(wire + 24, hello->generation);
    for (i = 0; i < sizeof hello->build; i++)
        wire[28 + i] = hello->build[i];
}

void loader_hello_decode(const uint8_t wire[LOADER_HELLO_SIZE], loader_hello_t *hello)
{
    uint8_t i;

    hello->protocol = wire[0];
    hello->why = wire[1];
    hello->active = wire[2];
    hello->sectors = wire[3];
    hello->bank_size = be_get32(wire + 4);
    hello->ram_first = be_get32(wire + 8);
    hello->ram_end = be_get32(wire + 12);
    hello->length = be_get32(wire + 16);
    hello->crc32 = be_get32(wire + 20);
    hello->generation = be_get32(wire + 24);
    for (i = 0; i < sizeof hello->build; i++)
        hello->build[i] = wire[28 + i];
}
