/* Flash and FPGA behind the firmware's drivers, for tests on the PC.
 *
 * The flash is 16 MiB of memory with a CFI mode. Streamed blocks arrive at the FPGA if, and only
 * if, both are selected. The knobs break one thing each; fake_turret_reset() mends everything. */
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
    int selected;
    long reads; /* bytes read one by one */
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

extern fake_flash_t fake_flash;
extern fake_fpga_t fake_fpga;

/* Erased flash, FPGA unconfigured, everything in order. */
void fake_turret_reset(void);

/* Write a whole bitstream of `length` bytes, byte i = seed + 7 * i, into a bank. */
void fake_flash_store(uint8_t slot, uint8_t bank, uint32_t length, uint32_t generation,
                      uint8_t seed);

/* Write a record into place `place` of a bank. */
void fake_flash_record(uint8_t slot, uint8_t bank, uint16_t place, uint8_t kind, uint32_t sequence);

#endif
