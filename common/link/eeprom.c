#include "link/eeprom.h"

#include "link/bytes.h"
#include "link/crc.h"

void eeprom_serial_encode(const char text[EEPROM_SERIAL_TEXT], uint8_t wire[EEPROM_SERIAL_SIZE])
{
    uint8_t i;

    wire[0] = 'S';
    wire[1] = 'N';
    for (i = 0; i < EEPROM_SERIAL_TEXT; i++)
        wire[EEPROM_SERIAL_TEXT_AT + i] = (uint8_t)text[i];
    be_put16(wire + EEPROM_SERIAL_AT_CRC16, crc16_ccitt(CRC16_INIT, wire, EEPROM_SERIAL_AT_CRC16));
}

uint8_t eeprom_serial_check(const uint8_t wire[EEPROM_SERIAL_SIZE])
{
    uint16_t crc = crc16_ccitt(CRC16_INIT, wire, EEPROM_SERIAL_AT_CRC16);

    return wire[0] == 'S' && be_get16(wire + EEPROM_SERIAL_AT_CRC16) == crc;
}
