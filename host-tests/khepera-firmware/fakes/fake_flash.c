#include "fake_flash.h"

#include <string.h>

#define BUSY_READS 5u
#define DQ7        0x80u
#define DQ6        0x40u
#define DQ5        0x20u

static uint32_t sector_size(uint32_t address)
{
    if (address < 0x4000)
        return 0x4000;
    if (address < 0x8000)
        return 0x2000;
    return address < 0x10000 ? 0x8000 : 0x10000;
}

static uint16_t word_at(const fake_flash_t *chip, uint32_t address)
{
    return (uint16_t)(chip->cells[address] << 8 | chip->cells[address + 1]);
}

static void finish(fake_flash_t *chip)
{
    if (chip->erasing) {
        uint32_t size = sector_size(chip->address);

        memset(chip->cells + (chip->address & ~(size - 1)), 0xFF, size);
    } else {
        chip->cells[chip->address] &= (uint8_t)(chip->data >> 8);
        chip->cells[chip->address + 1] &= (uint8_t)chip->data;
    }
}

static uint16_t fake_read(void *context, uint32_t address)
{
    fake_flash_t *chip = context;
    uint16_t status;

    if (chip->busy == 0)
        return word_at(chip, address);
    status = (uint16_t)((~chip->data & DQ7) | (chip->busy & 1u ? DQ6 : 0));
    if (chip->sticks)
        return (uint16_t)(status | DQ5);
    if (--chip->busy == 0)
        finish(chip);
    return status;
}

static void begin(fake_flash_t *chip, uint32_t address, uint16_t data, int erasing)
{
    chip->operations++;
    chip->address = address;
    chip->data = data;
    chip->erasing = erasing;
    chip->busy = BUSY_READS;
    chip->sequence = 0;
}

static void fake_write(void *context, uint32_t address, uint16_t value)
{
    /* The steps of a command: where, and what. */
    static const struct {
        uint32_t address;
        uint16_t value;
    } unlock[2] = {{0xAAA, 0xAA}, {0x554, 0x55}};
    fake_flash_t *chip = context;
    unsigned step = chip->sequence % 10;

    if (value == 0xF0) {
        chip->busy = 0;
        chip->sequence = 0;
    } else if (chip->busy > 0) {
        chip->stray_writes++;
    } else if (chip->sequence == 20) {
        begin(chip, address, value, 0);
    } else if (step < 2 && address == unlock[step].address && value == unlock[step].value) {
        chip->sequence++;
    } else if (chip->sequence == 2 && value == 0xA0) {
        chip->sequence = 20;
    } else if (chip->sequence == 2 && value == 0x80) {
        chip->sequence = 10;
    } else if (chip->sequence == 12 && value == 0x30) {
        begin(chip, address, 0xFFFF, 1);
    } else {
        chip->stray_writes++;
        chip->sequence = 0;
    }
}

void fake_flash_init(fake_flash_t *chip)
{
    memset(chip, 0, sizeof *chip);
    memset(chip->cells, 0xFF, sizeof chip->cells);
}

flash_bus_t fake_flash_bus(fake_flash_t *chip)
{
    flash_bus_t bus;

    bus.context = chip;
    bus.read = fake_read;
    bus.write = fake_write;
    return bus;
}
