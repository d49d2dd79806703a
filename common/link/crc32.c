#include "link/crc.h"

uint32_t crc32_update(uint32_t crc, const uint8_t *data, uint16_t length)
{
    uint8_t bit;

    while (length--) {
        crc ^= *data++;
        for (bit = 0; bit < 8; bit++) {
            if (crc & 1u)
                crc = (crc >> 1) ^ 0xEDB88320ul;
            else
                crc >>= 1;
        }
    }
    return crc;
}
