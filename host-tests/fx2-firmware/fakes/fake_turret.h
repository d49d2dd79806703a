/* Flash and FPGA behind the firmware's drivers, for tests on the PC.
 *
 * The flash is 16 MiB of memory that understands the AMD commands for identification, erasing a
 * sector and writing by the buffer; anything else is a failed assertion. Streamed bytes arrive at
 * the FPGA if, and only if, it is selected. The knobs break one thing each; fake_turret_reset()
 * mends everything. */
#ifndef FAKES_FAKE_TURRET_H
#define FAKES_FAKE_TURRET_H

#include "link/slots.h"

#include <stdint.h>

#define FAKE_NEVER 0xFFFFFFFFu

typedef struct {
    uint8_t memory[FLASH_SIZE];
    int present;       /* 0: nobody drives the bus, it reads FF */
    int busy_polls;    /* RY/BY# reads busy so often */
    uint8_t size_code; /* CFI: 2^n bytes */
    int command_set;   /* CFI: 2 = AMD */
    int cfi_mode;      /* 1 between the query and a reset command */
    int failed;        /* 1 after a failure, until a reset command: reads show status */
    int selected;
    long reads;         /* bytes read one by one */
    int step;           /* how far a command has come */
    int busy_for_each;  /* each operation makes RY/BY# read busy so often */
    long operations;    /* erasures and programmings so far */
    long fail_at;       /* the operation with this number fails; FAKE_NEVER */
    long cut_at;        /* during the one with this number the supply fails; FAKE_NEVER */
    int cut_how;        /* 0: before it, 1: in the middle, 2: right after it */
    void (*cut)(void);  /* does not return */
    uint32_t buffer_at; /* the write buffer */
    uint8_t buffer[64];
    int buffer_size;
    int buffer_count;
} fake_flash_t;

typedef struct {
    int present;        /* 0: INIT# stays high, DONE low */
    int clears;         /* 0: INIT# never rises after PROG# */
    uint32_t bad_byte;  /* INIT# falls once so many bytes are in; FAKE_NEVER */
    uint32_t done_byte; /* DONE rises with so many; FAKE_NEVER */
    int stream_sticks;  /* a block never ends */
    int selected;
    int program_low;    /* PROG# is low now */
    int program_pulses; /* times PROG# fell */
    int init;           /* pins */
    int done;
    uint8_t taken[BANK_HEADER_AT]; /* bytes clocked in since PROG# */
    uint32_t taken_count;
} fake_fpga_t;

/* What the host sends to endpoint 02 while drivers/usb_stream.h streams: some bytes a look. */
typedef struct {
    const uint8_t *data;
    uint32_t length;
    uint32_t sent;
    int streaming;
    uint32_t left; /* of what was announced */
} fake_usb_stream_t;

extern fake_flash_t fake_flash;
extern fake_fpga_t fake_fpga;
extern fake_usb_stream_t fake_usb_stream;

/* Erased flash, FPGA unconfigured, everything in order. */
void fake_turret_reset(void);

/* Write a whole bitstream of `length` bytes, byte i = seed + 7 * i, into a bank. */
void fake_flash_store(uint8_t slot, uint8_t bank, uint32_t length, uint32_t generation,
                      uint8_t seed);

/* Write a record into place `place` of a bank. */
void fake_flash_record(uint8_t slot, uint8_t bank, uint16_t place, uint8_t kind, uint32_t sequence);

#endif
