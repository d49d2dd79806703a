/* The loader's requests (common/link/loader.h) and the choice of the image: no register in here.
 *
 * Rules that keep a power cut from costing the program: only the bank that is not active is ever
 * changed; its header is written when the program behind it has been read back and summed up, and
 * the header's commit word last. */
#ifndef LOADER_OBEY_H
#define LOADER_OBEY_H

#include <stdint.h>

#include "drivers/flash.h"
#include "link/base_image.h"
#include "link/crc.h"
#include "link/loader.h"

typedef struct {
    const flash_bus_t *bus;
    const uint8_t *memory;       /* the flash's contents as the CPU reads them */
    void (*idle)(void *context); /* called at least every few ms while something takes long */
    void *context;
    uint8_t why;        /* LOADER_WHY_* */
    uint8_t active;     /* bank with the newest whole image, or LOADER_NO_BANK */
    base_image_t image; /* its header */
    uint32_t table[CRC32_TABLE_SIZE];
} loader_t;

/* Fill the table; nothing is active yet. The caller has set bus, memory, idle and context. */
void loader_init(loader_t *loader);

/* Find the newest image that is whole: 3 ms a KiB. */
void loader_survey(loader_t *loader);

/* Address in the flash of the active image's program. */
uint32_t loader_program_address(const loader_t *loader);

/* Obey one request; returns the size of reply[], whose first byte is the status. LOADER_RUN and
 * LOADER_SPEED are only judged: the caller does what they ask for once it has sent the reply. */
uint16_t loader_obey(loader_t *loader, uint8_t type, const uint8_t *payload, uint16_t size,
                     uint8_t reply[LOADER_PAYLOAD_MAX]);

#endif
