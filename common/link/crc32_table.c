#include "link/crc.h"

void crc32_table_fill(uint32_t table[CRC32_TABLE_SIZE])
{
    static const uint8_t zero = 0;
    uint16_t i;

    for (i = 0; i < CRC32_TABLE_SIZE; i++)
        table[i] = crc32_update(i, &zero, 1);
}

uint32_t crc32_update_table(const uint32_t table[CRC32_TABLE_SIZE], uint32_t crc,
                            const uint8_t *data, uint16_t length)
{
    while (length--)
        crc = (crc >> 8) ^ table[(uint8_t)crc ^ *data++];
    return crc;
}
