#include "link/crc.h"

uint16_t crc16_ccitt(uint16_t crc, const uint8_t *data, uint16_t length)
{
    uint8_t bit;

    while (length--) {
        crc ^= (uint16_t)((uint16_t)*data++ << 8);
        for (bit = 0; bit < 8; bit++) {
            if (crc & 0x8000u)
                crc = (uint16_t)((uint16_t)(crc << 1) ^ 0x1021u);
            else
                crc = (uint16_t)(crc << 1);
        }
    }
    return crc;
}
