#include "loader/obey.h"

#include "board/khepera.h"
#include "link/bytes.h"

#define BANKS        2u
#define BANK_BLOCKS  (BOARD_IMAGE_BANK_SIZE / LOADER_BLOCK_SIZE)
#define BANK_SECTORS (BOARD_IMAGE_BANK_SIZE / BOARD_IMAGE_SECTOR_SIZE)
#define ERASED       0xFFu
/* The range that SCBR can divide to and a polled receiver can follow. */
#define SPEED_MIN    300u
#define SPEED_MAX    115200u

static const uint32_t bank_address[BANKS] = {BOARD_IMAGE_A, BOARD_IMAGE_B};

static uint32_t crc_of(const loader_t *loader, uint32_t address, uint32_t length)
{
    uint32_t crc = CRC32_INIT;

    while (length > 0) {
        uint16_t piece = length < LOADER_BLOCK_SIZE ? (uint16_t)length : LOADER_BLOCK_SIZE;

        crc = crc32_update_table(loader->table, crc, loader->memory + address, piece);
        address += piece;
        length -= piece;
        loader->idle(loader->context);
    }
    return crc32_final(crc);
}

/* Whether an image with this header can be loaded and started here. */
static int fits(const base_image_t *image)
{
    return image->length > 0 && image->length <= BOARD_IMAGE_BANK_SIZE - BASE_IMAGE_PROGRAM_AT &&
           image->load % 2 == 0 && image->load >= BOARD_PROGRAM_BASE &&
           image->load < BOARD_PROGRAM_END && image->length <= BOARD_PROGRAM_END - image->load &&
           image->entry % 2 == 0 && image->entry >= image->load &&
           image->entry - image->load < image->length;
}

static int whole(const loader_t *loader, uint8_t bank, const base_image_t *image)
{
    return crc_of(loader, bank_address[bank] + BASE_IMAGE_PROGRAM_AT, image->length) ==
           image->crc32;
}

/* Whether the bank has a committed header; the program behind it is not looked at. */
static int has_header(const loader_t *loader, uint8_t bank, base_image_t *image)
{
    const uint8_t *wire = loader->memory + bank_address[bank];

    return be_get32(wire + BASE_IMAGE_COMMIT_AT) == BASE_IMAGE_COMMIT_WORD &&
           base_image_decode(wire, image) == BASE_IMAGE_OK && fits(image);
}

/* Generations wrap. */
static int newer(uint32_t one, uint32_t other)
{
    return one != other && one - other < 0x80000000ul;
}

void loader_init(loader_t *loader)
{
    crc32_table_fill(loader->table);
    loader->active = LOADER_NO_BANK;
    loader->why = LOADER_WHY_NO_IMAGE;
}

void loader_survey(loader_t *loader)
{
    base_image_t image[BANKS] = {{0, 0, 0, 0, 0, {0}}, {0, 0, 0, 0, 0, {0}}};
    int there[BANKS];
    uint8_t bank;
    uint8_t i;

    for (bank = 0; bank < BANKS; bank++)
        there[bank] = has_header(loader, bank, &image[bank]);
    bank = there[1] && (!there[0] || newer(image[1].generation, image[0].generation)) ? 1 : 0;
    loader->active = LOADER_NO_BANK;
    for (i = 0; i < BANKS && loader->active == LOADER_NO_BANK; i++, bank ^= 1u) {
        if (there[bank] && whole(loader, bank, &image[bank])) {
            loader->active = bank;
            loader->image = image[bank];
        }
    }
}

uint32_t loader_program_address(const loader_t *loader)
{
    return bank_address[loader->active & 1u] + BASE_IMAGE_PROGRAM_AT;
}

/* The bank that may be changed. */
static uint8_t target(const loader_t *loader)
{
    return loader->active == 0 ? 1 : 0;
}

static uint8_t program(const loader_t *loader, uint32_t address, const uint8_t *bytes,
                       uint16_t size)
{
    uint16_t i;

    for (i = 0; i < size; i += 2) {
        if (flash_program(loader->bus, address + i, be_get16(bytes + i)) != FLASH_OK)
            return LOADER_FLASH_FAILED;
    }
    return LOADER_OK;
}

static uint8_t erase(const loader_t *loader, uint32_t address)
{
    flash_error_t error;

    flash_erase_begin(loader->bus, address);
    do {
        loader->idle(loader->context);
        error = flash_erase_poll(loader->bus, address);
    } while (error == FLASH_BUSY);
    return error == FLASH_OK ? LOADER_OK : LOADER_FLASH_FAILED;
}

/* ---- Requests: each gets a payload of the size that it wants, and returns a status ---- */

static uint8_t obey_erase(loader_t *loader, const uint8_t *payload)
{
    if (payload[0] >= BANK_SECTORS)
        return LOADER_OUT_OF_RANGE;
    return erase(loader,
                 bank_address[target(loader)] + (uint32_t)(payload[0] * BOARD_IMAGE_SECTOR_SIZE));
}

static int is_program_block(uint16_t block)
{
    return block >= BASE_IMAGE_PROGRAM_AT / LOADER_BLOCK_SIZE && block < BANK_BLOCKS;
}

static uint8_t obey_write(loader_t *loader, const uint8_t *payload)
{
    uint16_t block = be_get16(payload);

    if (!is_program_block(block))
        return LOADER_OUT_OF_RANGE;
    return program(loader, bank_address[target(loader)] + (uint32_t)block * LOADER_BLOCK_SIZE,
                   payload + 2, LOADER_BLOCK_SIZE);
}

static uint8_t obey_copy(loader_t *loader, const uint8_t *payload)
{
    uint16_t block = be_get16(payload);
    uint32_t at = (uint32_t)block * LOADER_BLOCK_SIZE;
    uint8_t bytes[LOADER_BLOCK_SIZE];
    uint16_t i;

    if (!is_program_block(block))
        return LOADER_OUT_OF_RANGE;
    if (loader->active == LOADER_NO_BANK)
        return LOADER_NOT_ACTIVE;
    for (i = 0; i < LOADER_BLOCK_SIZE; i++)
        bytes[i] = loader->memory[bank_address[loader->active] + at + i];
    return program(loader, bank_address[target(loader)] + at, bytes, LOADER_BLOCK_SIZE);
}

static uint8_t obey_commit(loader_t *loader, const uint8_t *payload)
{
    static const uint8_t commit[BASE_IMAGE_COMMIT_SIZE] = {'C', 'O', 'M', 'T'};
    base_image_t image;
    uint8_t bank = target(loader);
    uint8_t status;

    if (base_image_decode(payload, &image) != BASE_IMAGE_OK || !fits(&image))
        return LOADER_BAD_HEADER;
    if (loader->active != LOADER_NO_BANK) {
        /* Asked again: it is done already. */
        if (image.generation == loader->image.generation && image.crc32 == loader->image.crc32)
            return LOADER_OK;
        if (!newer(image.generation, loader->image.generation))
            return LOADER_BAD_HEADER;
    }
    if (!whole(loader, bank, &image))
        return LOADER_BAD_IMAGE;
    status = program(loader, bank_address[bank], payload, BASE_IMAGE_HEADER_SIZE);
    if (status == LOADER_OK)
        status = program(loader, bank_address[bank] + BASE_IMAGE_COMMIT_AT, commit, sizeof commit);
    if (status == LOADER_OK) {
        loader->active = bank;
        loader->image = image;
    }
    return status;
}

static uint8_t obey_speed(loader_t *loader, const uint8_t *payload)
{
    uint32_t baud = be_get32(payload);

    (void)loader;
    return baud < SPEED_MIN || baud > SPEED_MAX ? LOADER_OUT_OF_RANGE : LOADER_OK;
}

static uint8_t obey_run(loader_t *loader, const uint8_t *payload)
{
    (void)loader;
    (void)payload;
    return LOADER_OK;
}

/* ---- Requests that are answered with more than a status ---- */

static uint16_t obey_hello(const loader_t *loader, uint8_t *reply)
{
    static const base_image_t none = {0, 0, 0, 0, 0, {0}};
    const base_image_t *image = loader->active == LOADER_NO_BANK ? &none : &loader->image;
    loader_hello_t hello;
    uint16_t i;

    hello.protocol = LOADER_PROTOCOL;
    hello.why = loader->why;
    hello.active = loader->active;
    hello.sectors = BANK_SECTORS;
    hello.bank_size = BOARD_IMAGE_BANK_SIZE;
    hello.ram_first = BOARD_PROGRAM_BASE;
    hello.ram_end = BOARD_PROGRAM_END;
    hello.length = image->length;
    hello.crc32 = image->crc32;
    hello.generation = image->generation;
    for (i = 0; i < BASE_IMAGE_BUILD_SIZE; i++)
        hello.build[i] = image->build[i];
    reply[0] = LOADER_OK;
    loader_hello_encode(&hello, reply + 1);
    return 1 + LOADER_HELLO_SIZE;
}

static uint16_t obey_sums(const loader_t *loader, const uint8_t *payload, uint8_t *reply)
{
    uint8_t bank = payload[0];
    uint16_t first = be_get16(payload + 1);
    uint8_t count = payload[3];
    uint8_t i;

    if (bank >= BANKS || count == 0 || count > LOADER_SUMS_MAX || first >= BANK_BLOCKS ||
        count > BANK_BLOCKS - first) {
        reply[0] = LOADER_OUT_OF_RANGE;
        return 1;
    }
    reply[0] = LOADER_OK;
    for (i = 0; i < count; i++) {
        uint32_t at = bank_address[bank] + (uint32_t)(first + i) * LOADER_BLOCK_SIZE;

        be_put32(reply + 1 + 4u * i, crc_of(loader, at, LOADER_BLOCK_SIZE));
    }
    return (uint16_t)(1u + 4u * count);
}

uint16_t loader_obey(loader_t *loader, uint8_t type, const uint8_t *payload, uint16_t size,
                     uint8_t reply[LOADER_PAYLOAD_MAX])
{
    static const struct {
        uint8_t type;
        uint16_t size;
        uint8_t (*obey)(loader_t *loader, const uint8_t *payload);
    } requests[] = {
        {LOADER_ERASE, 1, obey_erase}, {LOADER_WRITE, 2 + LOADER_BLOCK_SIZE, obey_write},
        {LOADER_COPY, 2, obey_copy},   {LOADER_COMMIT, BASE_IMAGE_HEADER_SIZE, obey_commit},
        {LOADER_RUN, 0, obey_run},     {LOADER_SPEED, 4, obey_speed},
    };
    uint8_t i;

    if (type == LOADER_HELLO && size == 0)
        return obey_hello(loader, reply);
    if (type == LOADER_SUMS && size == 4)
        return obey_sums(loader, payload, reply);
    reply[0] = type == LOADER_HELLO || type == LOADER_SUMS ? LOADER_BAD_SIZE : LOADER_UNKNOWN;
    for (i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        if (requests[i].type == type)
            reply[0] =
                requests[i].size == size ? requests[i].obey(loader, payload) : LOADER_BAD_SIZE;
    }
    return 1;
}
