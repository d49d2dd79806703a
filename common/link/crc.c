#include "link/crc.h"

uint16_t crc16_ccitt(uint16_t crc, const uint8_t *data, uint16_t length)
{
    while (length--)
        crc = crc16_ccitt_step(crc, *data++);
    return crc;
}
