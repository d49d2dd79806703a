#include "host-tests/fx2-firmware/fakes/fake_turret.h"

#include "board/turret.h"
#include "drivers/flash_bus.h"
#include "drivers/flash_stream.h"
#include "drivers/fpga_port.h"
#include "drivers/usb_stream.h"
#include "link/bytes.h"

#include <assert.h>
#include <string.h>

fake_flash_t fake_flash;
fake_fpga_t fake_fpga;
fake_usb_stream_t fake_usb_stream;

uint16_t flash_at_block;
uint16_t flash_at_offset;

static int streaming; /* between begin and end */
static uint32_t stream_address;

void fake_turret_reset(void)
{
    memset(&fake_flash, 0, sizeof fake_flash);
    memset(fake_flash.memory, 0xFF, sizeof fake_flash.memory);
    fake_flash.present = 1;
    fake_flash.size_code = 24;
    fake_flash.command_set = 2;
    fake_flash.fail_at = FAKE_NEVER;
    fake_flash.cut_at = FAKE_NEVER;
    memset(&fake_fpga, 0, sizeof fake_fpga);
    fake_fpga.present = 1;
    fake_fpga.clears = 1;
    fake_fpga.bad_byte = FAKE_NEVER;
    fake_fpga.done_byte = FAKE_NEVER;
    fake_fpga.init = 1;
    memset(&fake_usb_stream, 0, sizeof fake_usb_stream);
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

uint8_t flash_bus_is_selected(void)
{
    return (uint8_t)fake_flash.selected;
}

static uint32_t address(void)
{
    return (uint32_t)flash_at_block * TURRET_FLASH_BLOCK + flash_at_offset;
}

static uint8_t read_one(uint32_t at)
{
    if (!fake_flash.selected || !fake_flash.present)
        return 0xFF;
    if (fake_flash.failed)
        return 0x20;
    return fake_flash.cfi_mode ? read_cfi(at) : fake_flash.memory[at];
}

void flash_bus_read(uint8_t *data, uint8_t length)
{
    assert(length > 0 && address() % TURRET_FLASH_BLOCK + length <= TURRET_FLASH_BLOCK);
    assert(address() + length <= FLASH_SIZE && !streaming && fake_flash.busy_polls == 0);
    fake_flash.reads += length;
    for (uint8_t i = 0; i < length; i++)
        data[i] = read_one(address() + i);
}

/* Whether the operation that begins is to be carried out, and how much of it: 0, 1 or 2 halves. */
static int halves(void)
{
    long number = fake_flash.operations++;

    fake_flash.busy_polls = fake_flash.busy_for_each;
    if (number == fake_flash.fail_at) {
        fake_flash.failed = 1;
        return 1;
    }
    return number == fake_flash.cut_at ? fake_flash.cut_how : 2;
}

static void cut_if_due(void)
{
    if (fake_flash.operations == fake_flash.cut_at + 1)
        fake_flash.cut();
}

/* Half erased is neither what it was nor erased. */
static void erase(uint32_t at)
{
    uint8_t *sector = fake_flash.memory + at / FLASH_SECTOR_SIZE * FLASH_SECTOR_SIZE;
    int how = halves();

    for (uint32_t i = 0; i < FLASH_SECTOR_SIZE; i++) {
        if (how == 2)
            sector[i] = 0xFF;
        else if (how == 1)
            sector[i] &= (uint8_t)(i * 37u);
    }
    cut_if_due();
}

/* Half programmed: the bytes of the first half, and half the bits of the next. */
static void program(void)
{
    int how = halves();
    int whole = fake_flash.buffer_count * how / 2;

    for (int i = 0; i < fake_flash.buffer_count; i++) {
        uint8_t *byte = fake_flash.memory + fake_flash.buffer_at + i;

        if (i < whole)
            *byte &= fake_flash.buffer[i];
        else if (i == whole && how == 1)
            *byte &= (uint8_t)(fake_flash.buffer[i] | 0xAA);
        if (how == 2 && *byte != fake_flash.buffer[i])
            fake_flash.failed = 1;
    }
    cut_if_due();
}

enum { READING, UNLOCKED_1, UNLOCKED_2, ERASE, ERASE_1, ERASE_2, COUNT, DATA, CONFIRM, ABORTED };

static int buffer_write(uint32_t at, uint8_t value)
{
    switch (fake_flash.step) {
    case COUNT:
        fake_flash.buffer_at = at;
        fake_flash.buffer_size = value + 1;
        fake_flash.buffer_count = 0;
        fake_flash.step = value < sizeof fake_flash.buffer ? DATA : ABORTED;
        return 1;
    case DATA:
        if (at / 64 != fake_flash.buffer_at / 64) {
            fake_flash.step = ABORTED;
            return 1;
        }
        assert(at == fake_flash.buffer_at + (uint32_t)fake_flash.buffer_count);
        fake_flash.buffer[fake_flash.buffer_count++] = value;
        if (fake_flash.buffer_count == fake_flash.buffer_size)
            fake_flash.step = CONFIRM;
        return 1;
    case CONFIRM:
        fake_flash.step = value == 0x29 ? READING : ABORTED;
        if (value == 0x29)
            program();
        return 1;
    default:
        return 0;
    }
}

static void cycle(uint32_t at, uint8_t value)
{
    if (!fake_flash.selected || !fake_flash.present)
        return;
    assert(!streaming && fake_flash.busy_polls == 0);
    if (buffer_write(at, value))
        return;
    if (at == 0xAAA && value == 0xAA) {
        fake_flash.step = fake_flash.step == ERASE ? ERASE_1 : UNLOCKED_1;
    } else if (at == 0x555 && value == 0x55) {
        fake_flash.step = fake_flash.step == ERASE_1 ? ERASE_2 : UNLOCKED_2;
    } else if (value == 0xF0 && (fake_flash.step == UNLOCKED_2 || fake_flash.step != ABORTED)) {
        fake_flash.step = READING;
        fake_flash.cfi_mode = 0;
        fake_flash.failed = 0;
    } else if (value == 0x98 && at == 0xAA) {
        fake_flash.cfi_mode = 1;
    } else if (fake_flash.step == UNLOCKED_2 && value == 0x25) {
        fake_flash.step = COUNT;
    } else if (fake_flash.step == UNLOCKED_2 && value == 0x80 && at == 0xAAA) {
        fake_flash.step = ERASE;
    } else if (fake_flash.step == ERASE_2 && value == 0x30) {
        fake_flash.step = READING;
        erase(at);
    } else {
        assert(!"a command that nobody should send");
    }
}

void flash_bus_write(uint8_t value)
{
    cycle(address(), value);
}

void flash_bus_command(uint16_t offset, uint8_t value)
{
    cycle(offset, value);
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
    if (!fake_fpga.selected || fake_fpga.program_low || !fake_fpga.init)
        return;
    if (fake_fpga.taken_count < sizeof fake_fpga.taken)
        fake_fpga.taken[fake_fpga.taken_count] = byte;
    fake_fpga.taken_count++;
    if (fake_fpga.taken_count == fake_fpga.bad_byte)
        fake_fpga.init = 0;
    else if (fake_fpga.taken_count == fake_fpga.done_byte)
        fake_fpga.done = 1;
}

uint8_t flash_stream_blocks(uint8_t count)
{
    uint32_t left = (uint32_t)count * TURRET_FLASH_BLOCK;

    assert(streaming && count > 0 && fake_flash.selected);
    assert(stream_address % TURRET_FLASH_BLOCK == 0);
    if (fake_fpga.stream_sticks)
        return 0;
    while (left--)
        clock_byte_in(fake_flash.memory[stream_address++]);
    return 1;
}

/* ---- the stream from USB behind drivers/usb_stream.h ---- */

void usb_stream_begin(const uint8_t length[4])
{
    assert(!streaming && !fake_flash.selected && fake_fpga.selected);
    fake_usb_stream.streaming = 1;
    fake_usb_stream.left = be_get32(length);
    assert(fake_usb_stream.left != 0);
}

static void stream_some(void)
{
    uint32_t some = 4000;

    while (fake_usb_stream.streaming && some-- && fake_usb_stream.left != 0 &&
           fake_usb_stream.sent < fake_usb_stream.length) {
        clock_byte_in(fake_usb_stream.data[fake_usb_stream.sent++]);
        fake_usb_stream.left--;
    }
}

uint16_t usb_stream_left_256(void)
{
    stream_some();
    return (uint16_t)(fake_usb_stream.left >> 8);
}

uint8_t usb_stream_done(void)
{
    return fake_usb_stream.left == 0;
}

uint8_t usb_stream_surplus(void)
{
    return fake_usb_stream.sent < fake_usb_stream.length;
}

void usb_stream_end(void)
{
    fake_usb_stream.streaming = 0;
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
