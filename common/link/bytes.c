#include "link/bytes.h"

void be_put16(uint8_t *at, uint16_t value)
{
    at[0] = (uint8_t)(value >> 8);
    at[1] = (uint8_t)value;
}

void be_put32(uint8_t *at, uint32_t value)
{
    uint8_t i;

    for (i = 0; i < 4; i++) {
        *at++ = (uint8_t)(value >> 24);
        value <<= 8;
    }
}

uint16_t be_get16(const uint8_t *at)
{
    return (uint16_t)(((uint16_t)at[0] << 8) | at[1]);
}

uint32_t be_get32(const uint8_t *at)
{
    return ((uint32_t)be_get16(at) << 16) | be_get16(at + 2);
}
