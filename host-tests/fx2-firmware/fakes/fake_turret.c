#include "host-tests/fx2-firmware/fakes/fake_turret.h"

#include "board/turret.h"
#include "drivers/flash_bus.h"
#include "drivers/flash_stream.h"
#include "drivers/fpga_port.h"
#include "link/bytes.h"

#include <assert.h>
#include <string.h>

fake_flash_t fake_flash;
fake_fpga_t fake_fpga;

static int streaming; /* between begin and end */
static uint32_t stream_address;

void fake_turret_reset(void)
{
    memset(&fake_flash, 0, sizeof fake_flash);
    memset(fake_flash.memory, 0xFF, sizeof fake_flash.memory);
    fake_flash.present = 1;
    fake_flash.size_code = 24;
    fake_flash.command_set = 2;
    memset(&fake_fpga, 0, sizeof fake_fpga);
    fake_fpga.present = 1;
    fake_fpga.clears = 1;
    fake_fpga.bad_byte = FAKE_NEVER;
    fake_fpga.done_byte = FAKE_NEVER;
    fake_fpga.init = 1;
    streaming = 0;
}

void fake_flash_store(uint8_t slot, uint8_t bank, uint32_t length, uint32_t generation,
                      uint8_t seed)
{
    uint8_t *at = fake_flash.memory + BANK_ADDRESS(slot, bank);
    slot_header_t header = {0};
    uint32_t i;

    for (i = 0; i < length; i++)
        at[i] = (uint8_t)(seed + 7u * i);
    header.function = 1;
    header.length = length;
    header.generation = generation;
    strcpy(header.part, "v300ecs144");
    slot_header_encode(&header, at + BANK_HEADER_AT);
    be_put32(at + BANK_COMMIT_AT, SLOT_COMMIT_WORD);
}

void fake_flash_record(uint8_t slot, uint8_t bank, uint16_t place, uint8_t kind, uint32_t sequence)
{
    slot_record_encode(kind, sequence,
                       fake_flash.memory + BANK_ADDRESS(slot, bank) + BANK_RECORDS_AT +
                           (uint32_t)place * SLOT_RECORD_SIZE);
}

/* ---- the flash behind drivers/flash_bus.h and drivers/flash_stream.h ---- */

static uint8_t read_cfi(uint32_t address)
{
    switch (address) {
    case 0x20:
        return 'Q';
    case 0x22:
        return 'R';
    case 0x24:
        return 'Y';
    case 0x26:
        return (uint8_t)fake_flash.command_set;
    case 0x4E:
        return fake_flash.size_code;
    default:
        return 0;
    }
}

void flash_bus_select(void)
{
    fake_flash.selected = 1;
}

void flash_bus_release(void)
{
    fake_flash.selected = 0;
}

void flash_bus_read(uint16_t block, uint16_t offset, uint8_t *data, uint8_t length)
{
    uint32_t address = (uint32_t)block * TURRET_FLASH_BLOCK + offset;
    uint8_t i;

    assert(length > 0 && address % TURRET_FLASH_BLOCK + length <= TURRET_FLASH_BLOCK);
    assert(address + length <= FLASH_SIZE && !streaming);
    fake_flash.reads += length;
    for (i = 0; i < length; i++) {
        if (!fake_flash.selected || !fake_flash.present)
            data[i] = 0xFF;
        else if (fake_flash.cfi_mode)
            data[i] = read_cfi(address + i);
        else
            data[i] = fake_flash.memory[address + i];
    }
}

uint8_t flash_bus_erased(uint16_t block, uint16_t offset, uint8_t length)
{
    uint8_t byte;

    while (length--) {
        flash_bus_read(block, offset++, &byte, 1);
        if (byte != 0xFF)
            return 0;
    }
    return 1;
}

void flash_bus_write(uint16_t block, uint16_t offset, uint8_t value)
{
    assert(!streaming);
    if (!fake_flash.selected)
        return;
    if (value == 0xF0)
        fake_flash.cfi_mode = 0;
    else if (value == 0x98 && block == 0 && offset == 0xAA)
        fake_flash.cfi_mode = 1;
    else
        assert(!"a command that nobody should send");
}

uint8_t flash_bus_ready(void)
{
    if (fake_flash.busy_polls == 0)
        return 1;
    fake_flash.busy_polls--;
    return 0;
}

void flash_stream_begin(uint16_t block)
{
    stream_address = (uint32_t)block * TURRET_FLASH_BLOCK;
    streaming = 1;
}

void flash_stream_end(void)
{
    streaming = 0;
}

static void clock_byte_in(uint8_t byte)
{
    if (!fake_fpga.selected || !fake_flash.selected || fake_fpga.program_low || !fake_fpga.init)
        return;
    assert(fake_fpga.taken_count < sizeof fake_fpga.taken);
    fake_fpga.taken[fake_fpga.taken_count++] = byte;
    if (fake_fpga.taken_count == fake_fpga.bad_byte)
        fake_fpga.init = 0;
    else if (fake_fpga.taken_count == fake_fpga.done_byte)
        fake_fpga.done = 1;
}

uint8_t flash_stream_blocks(uint8_t count, uint16_t length)
{
    uint32_t left = (uint32_t)count * length;

    assert(streaming && count > 0 && length > 0);
    assert(length == TURRET_FLASH_BLOCK || (length < TURRET_FLASH_BLOCK && count == 1));
    assert(stream_address % TURRET_FLASH_BLOCK == 0);
    if (fake_fpga.stream_sticks)
        return 0;
    while (left--)
        clock_byte_in(fake_flash.memory[stream_address++]);
    return 1;
}

/* ---- the FPGA behind drivers/fpga_port.h ---- */

void fpga_port_program(uint8_t pull)
{
    if (pull && !fake_fpga.program_low)
        fake_fpga.program_pulses++;
    fake_fpga.program_low = pull;
    if (!fake_fpga.present)
        return;
    if (pull) {
        fake_fpga.init = 0;
        fake_fpga.done = 0;
        fake_fpga.taken_count = 0;
    } else {
        fake_fpga.init = fake_fpga.clears;
    }
}

void fpga_port_select(uint8_t selected)
{
    fake_fpga.selected = selected;
}

uint8_t fpga_port_init_level(void)
{
    return (uint8_t)fake_fpga.init;
}

uint8_t fpga_port_done_level(void)
{
    return (uint8_t)fake_fpga.done;
}
