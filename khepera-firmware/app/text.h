/* Putting text together without a C library: appends, always NUL-terminated, cuts what does not
 * fit. */
#ifndef APP_TEXT_H
#define APP_TEXT_H

#include <stdint.h>

typedef struct {
    char *at;
    uint16_t size; /* bytes of at[], the NUL included; > 0 */
    uint16_t used; /* characters so far */
} text_t;

/* An empty text in buffer[0..size-1]. */
void text_begin(text_t *text, char *buffer, uint16_t size);
void text_add(text_t *text, const char *string);
void text_add_decimal(text_t *text, int32_t value);
/* `digits` (1..8) hexadecimal digits. */
void text_add_hex(text_t *text, uint32_t value, uint8_t digits);

#endif
