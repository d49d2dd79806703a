/* Byte order on the wire: everything StereoSot defines is big-endian.
 *
 * Multi-byte fields are always taken apart and put together byte by byte, never by laying a struct
 * over a buffer: 8051, 68331 and PC differ in byte order and alignment.
 * All functions may be called from an interrupt. */
#ifndef LINK_BYTES_H
#define LINK_BYTES_H

#include <stdint.h>

/* Write `value` to at[0..1], most significant byte first. */
void be_put16(uint8_t *at, uint16_t value);
/* Write `value` to at[0..3], most significant byte first. */
void be_put32(uint8_t *at, uint32_t value);
/* Read at[0..1], most significant byte first. */
uint16_t be_get16(const uint8_t *at);
/* Read at[0..3], most significant byte first. */
uint32_t be_get32(const uint8_t *at);

#endif
