#include "eeprom-loader/writer.h"

#include "board/turret.h"
#include "drivers/clock.h"
#include "drivers/i2c.h"
#include "link/crc.h"
#include "link/eeprom.h"

#define WRITE_TICKS CLOCK_TICKS(20000ul)

/* Where the next read begins: an EEPROM goes on by itself. */
static uint8_t go_to(uint16_t address)
{
    i2c_bytes[0] = (uint8_t)(address >> 8);
    i2c_bytes[1] = (uint8_t)address;
    return i2c_write(TURRET_EEPROM_ADDRESS, 2) ? LOADER_NO_EEPROM : LOADER_OK;
}

uint8_t writer_read(uint16_t address, XDATA uint8_t *data, uint8_t length)
{
    uint8_t error = go_to(address);

    for (; !error && length != 0; length--) {
        if (i2c_read(TURRET_EEPROM_ADDRESS))
            error = LOADER_NO_EEPROM;
        *data++ = i2c_bytes[0];
    }
    return error;
}

/* While it writes, the EEPROM does not answer to its address. */
static uint8_t await_written(void)
{
    clock_start_wait();
    while (i2c_write(TURRET_EEPROM_ADDRESS, 0)) {
        if (clock_waited(WRITE_TICKS))
            return LOADER_TIMEOUT;
    }
    return LOADER_OK;
}

static uint8_t compare(uint16_t address, const XDATA uint8_t *data, uint8_t length)
{
    uint8_t error = go_to(address);

    for (; !error && length != 0; length--) {
        if (i2c_read(TURRET_EEPROM_ADDRESS))
            error = LOADER_NO_EEPROM;
        else if (i2c_bytes[0] != *data++)
            error = LOADER_DIFFERS;
    }
    return error;
}

uint8_t writer_write(uint16_t address, const XDATA uint8_t *data, uint8_t length)
{
    uint8_t error;
    uint8_t i;

    i2c_bytes[0] = (uint8_t)(address >> 8);
    i2c_bytes[1] = (uint8_t)address;
    for (i = 0; i != length; i++)
        i2c_bytes[2 + i] = data[i];
    if (i2c_write(TURRET_EEPROM_ADDRESS, (uint8_t)(2 + length)))
        return LOADER_NO_EEPROM;
    error = await_written();
    return error ? error : compare(address, data, length);
}

uint8_t writer_check(uint16_t length, uint8_t first, uint16_t crc)
{
    uint16_t sum = crc16_ccitt_step(CRC16_INIT, first);

    if (go_to(1))
        return LOADER_NO_EEPROM;
    while (--length != 0) {
        if (i2c_read(TURRET_EEPROM_ADDRESS))
            return LOADER_NO_EEPROM;
        sum = crc16_ccitt_step(sum, i2c_bytes[0]);
    }
    return sum == crc ? LOADER_OK : LOADER_BAD_CRC;
}
