/* Parameters that survive power-off: two copies in two flash sectors, each with a CRC.
 *
 * A sector is a row of records of STORE_RECORD_SIZE bytes, appended until it is full. `save` writes
 * the same record to both sectors, one after the other, so that at any moment, whenever the supply
 * fails, at least one sector ends with a whole record: the old one or the new one. A sector that is
 * full is erased while the other holds the newest record. docs/SPEC.md has the format.
 *
 * A save runs in small steps from the main loop: an erase takes most of a second, and control must
 * go on. */
#ifndef APP_PARAMETER_STORE_H
#define APP_PARAMETER_STORE_H

#include <stdint.h>

#include "app/parameters.h"

#define STORE_RECORD_SIZE 1024u
#define STORE_COPIES      2u
#define STORE_MAGIC       0x5041524Du /* "PARM" */
#define STORE_VERSION     1u
#define STORE_HEADER_SIZE 12u
#define STORE_ENTRY_SIZE  6u
/* Entries of a record: what fits before its check sum. */
#define STORE_ENTRIES_MAX ((STORE_RECORD_SIZE - STORE_HEADER_SIZE - 4u) / STORE_ENTRY_SIZE)

/* The flash below. Addresses are even; a word is programmed or an erase begun by one call. */
typedef struct {
    void *context;
    uint32_t sector[STORE_COPIES]; /* their addresses */
    uint32_t size;                 /* bytes of each, a multiple of STORE_RECORD_SIZE */
    uint16_t (*read)(void *context, uint32_t address);
    /* Program a word that reads FFFF (some 10 us): 1 if it took the value. */
    int (*program)(void *context, uint32_t address, uint16_t word);
    /* Begin to erase a sector; until it ends nothing in the flash may be read. */
    int (*erase_begin)(void *context, uint32_t sector);
    /* 1 done, 0 not yet, -1 failed. */
    int (*erase_poll)(void *context, uint32_t sector);
} store_flash_t;

typedef enum { STORE_IDLE, STORE_BUSY, STORE_DONE, STORE_FAILED } store_result_t;

typedef struct {
    const store_flash_t *flash;
    uint8_t record[STORE_RECORD_SIZE];
    uint16_t record_used;
    uint16_t at; /* bytes of the record programmed */
    uint32_t address;
    uint32_t generation; /* of the newest whole record, 0 = none */
    uint8_t state;
    uint8_t copy;
    uint8_t order[STORE_COPIES]; /* which sector is written first */
    uint8_t whole[STORE_COPIES]; /* sectors that held a whole record when the save began */
    uint8_t failures;            /* copies that could not be written */
} parameter_store_t;

void parameter_store_init(parameter_store_t *store, const store_flash_t *flash);

/* Read the newest whole record over `parameters` (defaults, usually). Values of unknown names and
 * values out of range are passed over. Returns how many values were taken, or -1 if there is no
 * whole record. */
int32_t parameter_store_load(parameter_store_t *store, parameters_t *parameters);

/* Begin to save what differs from the defaults. 0 if a save is under way. */
int parameter_store_save(parameter_store_t *store, const parameters_t *parameters);

/* Go on saving; STORE_DONE or STORE_FAILED once, at its end, else STORE_BUSY or STORE_IDLE. A save
 * that could write one copy only has failed, though nothing is lost. */
store_result_t parameter_store_step(parameter_store_t *store);

#endif
