#include "link/crc.h"

uint16_t crc16_ccitt_step(uint16_t crc, uint8_t byte)
{
    /* Eight steps of the polynomial x^16 + x^12 + x^5 + 1 at once: what leaves the register comes
     * back at bits 12, 5 and 0, and its upper four bits do so a second time. */
    uint8_t x = (uint8_t)((uint8_t)(crc >> 8) ^ byte);

    x ^= (uint8_t)(x >> 4);
    return (uint16_t)((uint16_t)(crc << 8) ^ (uint16_t)((uint16_t)x << 12) ^
                      (uint16_t)((uint16_t)x << 5) ^ x);
}
