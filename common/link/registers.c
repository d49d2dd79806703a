#include "link/registers.h"

#include "link/bytes.h"
#include "link/crc.h"

void register_write_encode(uint8_t address, uint16_t value, uint8_t wire[REGISTER_WRITE_BYTES])
{
    be_put16(wire, (uint16_t)(REGISTER_WORD_WRITE | (address & 0x7Fu)));
    be_put16(wire + 2, value);
    be_put16(wire + 4, crc16_ccitt(CRC16_INIT, wire, 4));
}

int register_write_decode(const uint8_t wire[REGISTER_WRITE_BYTES], uint8_t *address,
                          uint16_t *value)
{
    uint16_t first = be_get16(wire);

    if ((first & 0xFF80u) != REGISTER_WORD_WRITE)
        return 0;
    if (be_get16(wire + 4) != crc16_ccitt(CRC16_INIT, wire, 4))
        return 0;
    *address = (uint8_t)(first & 0x7Fu);
    *value = be_get16(wire + 2);
    return 1;
}

void register_read_encode(uint8_t address, uint16_t value, uint8_t wire[REGISTER_READ_BYTES])
{
    be_put16(wire, (uint16_t)(REGISTER_WORD_READ | (address & 0x7Fu)));
    be_put16(wire + 2, value);
    be_put16(wire + 4, crc16_ccitt(CRC16_INIT, wire, 4));
}

int register_read_decode(const uint8_t wire[REGISTER_READ_BYTES], uint16_t *value)
{
    if (be_get16(wire + 4) != crc16_ccitt(CRC16_INIT, wire, 4))
        return 0;
    *value = be_get16(wire + 2);
    return 1;
}
