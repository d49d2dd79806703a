#include "app/text.h"

void text_begin(text_t *text, char *buffer, uint16_t size)
{
    text->at = buffer;
    text->size = size;
    text->used = 0;
    buffer[0] = '\0';
}

static void add_character(text_t *text, char character)
{
    if (text->used + 1 >= text->size)
        return;
    text->at[text->used++] = character;
    text->at[text->used] = '\0';
}

void text_add(text_t *text, const char *string)
{
    while (*string != '\0')
        add_character(text, *string++);
}

void text_add_decimal(text_t *text, int32_t value)
{
    char digits[10];
    uint8_t count = 0;
    uint32_t rest = value < 0 ? 0u - (uint32_t)value : (uint32_t)value;

    do {
        digits[count++] = (char)('0' + rest % 10);
        rest /= 10;
    } while (rest != 0);
    if (value < 0)
        add_character(text, '-');
    while (count > 0)
        add_character(text, digits[--count]);
}

void text_add_hex(text_t *text, uint32_t value, uint8_t digits)
{
    while (digits > 0)
        add_character(text, "0123456789ABCDEF"[value >> (4 * --digits) & 0xFu]);
}
