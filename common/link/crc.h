/* Check sums of everything that crosses a wire or rests in flash.
 *
 * Both are computed without a table: it would not fit the 8 KB FX2. Who has a whole image to check
 * fills a table for CRC-32. May be called from an interrupt. */
#ifndef LINK_CRC_H
#define LINK_CRC_H

#include <stdint.h>

/* CRC-16/CCITT-FALSE: polynomial 0x1021, not reflected, no final xor; check("123456789") = 0x29B1.
 * Start with CRC16_INIT and feed as many pieces as you like. */
#define CRC16_INIT 0xFFFFu
uint16_t crc16_ccitt(uint16_t crc, const uint8_t *data, uint16_t length);
/* The same, one byte more: for an 8051, to which pointers are dear. */
uint16_t crc16_ccitt_step(uint16_t crc, uint8_t byte);

/* CRC-32 (IEEE 802.3): reflected polynomial 0xEDB88320; check("123456789") = 0xCBF43926.
 * Start with CRC32_INIT, feed pieces, and finish with crc32_final. */
#define CRC32_INIT 0xFFFFFFFFul
uint32_t crc32_update(uint32_t crc, const uint8_t *data, uint16_t length);
#define crc32_final(crc) ((crc) ^ 0xFFFFFFFFul)

/* The same with a table: crc32_update_table() gives what crc32_update() gives, four times as fast
 * on a 68331. */
#define CRC32_TABLE_SIZE 256u
void crc32_table_fill(uint32_t table[CRC32_TABLE_SIZE]);
uint32_t crc32_update_table(const uint32_t table[CRC32_TABLE_SIZE], uint32_t crc,
                            const uint8_t *data, uint16_t length);

#endif
