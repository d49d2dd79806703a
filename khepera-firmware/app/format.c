#include "app/format.h"

typedef struct {
    uint8_t left;
    uint8_t zeros;
    uint8_t width;
} field_t;

static inline void put(text_t *text, char character)
{
    if (text->used + 1u < text->size)
        text->at[text->used++] = character;
}

static void pad(text_t *text, char character, uint32_t used, uint8_t width)
{
    for (; used < width; used++)
        put(text, character);
}

static void put_string(text_t *text, const field_t *field, const char *string)
{
    uint32_t length = 0;

    if (field->width > 0)
        while (string[length] != '\0')
            length++;
    if (!field->left)
        pad(text, ' ', length, field->width);
    while (*string != '\0')
        put(text, *string++);
    if (field->left)
        pad(text, ' ', length, field->width);
}

static void put_number(text_t *text, const field_t *field, uint32_t value, int negative,
                       uint32_t base, const char *digits)
{
    char reversed[10];
    uint32_t count = 0;
    uint32_t length;

    do {
        reversed[count++] = digits[value % base];
        value /= base;
    } while (value != 0);
    length = count + (negative ? 1u : 0u);
    if (!field->left && !field->zeros)
        pad(text, ' ', length, field->width);
    if (negative)
        put(text, '-');
    if (!field->left && field->zeros)
        pad(text, '0', length, field->width);
    while (count > 0)
        put(text, reversed[--count]);
    if (field->left)
        pad(text, ' ', length, field->width);
}

static const char *read_field(const char *format, field_t *field)
{
    field->left = field->zeros = field->width = 0;
    for (; *format == '-' || *format == '0'; format++) {
        if (*format == '-')
            field->left = 1;
        else
            field->zeros = 1;
    }
    for (; *format >= '0' && *format <= '9'; format++)
        field->width = (uint8_t)(field->width * 10 + (*format - '0'));
    return format;
}

/* What follows a %, up to and with its letter. */
static const char *put_argument(text_t *text, const char *format, va_list *arguments)
{
    field_t field;
    int32_t number;

    format = read_field(format, &field);
    switch (*format) {
    case 'd':
        number = va_arg(*arguments, int32_t);
        put_number(text, &field, number < 0 ? 0u - (uint32_t)number : (uint32_t)number, number < 0,
                   10, "0123456789");
        break;
    case 'u':
        put_number(text, &field, va_arg(*arguments, uint32_t), 0, 10, "0123456789");
        break;
    case 'x':
        put_number(text, &field, va_arg(*arguments, uint32_t), 0, 16, "0123456789abcdef");
        break;
    case 'X':
        put_number(text, &field, va_arg(*arguments, uint32_t), 0, 16, "0123456789ABCDEF");
        break;
    case 's':
        put_string(text, &field, va_arg(*arguments, const char *));
        break;
    case 'c':
        put(text, (char)va_arg(*arguments, int));
        break;
    case '\0':
        return format;
    default:
        put(text, *format);
        break;
    }
    return format + 1;
}

void text_begin(text_t *text, char *buffer, uint16_t size)
{
    text->at = buffer;
    text->size = size;
    text->used = 0;
    buffer[0] = '\0';
}

void text_add_arguments(text_t *text, const char *format, va_list arguments)
{
    va_list left;

    va_copy(left, arguments);
    while (*format != '\0') {
        if (*format != '%')
            put(text, *format++);
        else
            format = put_argument(text, format + 1, &left);
    }
    va_end(left);
    text->at[text->used] = '\0';
}

void text_add(text_t *text, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    text_add_arguments(text, format, arguments);
    va_end(arguments);
}

int text_equal(const char *a, const char *b)
{
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
}

int text_begins(const char *text, const char *beginning)
{
    while (*beginning != '\0')
        if (*text++ != *beginning++)
            return 0;
    return 1;
}

const char *text_skip_blanks(const char *text)
{
    while (*text == ' ')
        text++;
    return text;
}

int text_word(const char *line, const char *word, const char **rest)
{
    line = text_skip_blanks(line);
    while (*word != '\0' && *line == *word) {
        line++;
        word++;
    }
    if (*word != '\0' || (*line != '\0' && *line != ' '))
        return 0;
    *rest = text_skip_blanks(line);
    return 1;
}

int text_number(const char **at, int32_t *value)
{
    const char *text = text_skip_blanks(*at);
    int negative = 0;
    uint32_t sum = 0;
    uint32_t largest;

    if (*text == '-' || *text == '+')
        negative = *text++ == '-';
    largest = negative ? 0x80000000u : 0x7FFFFFFFu;
    if (*text < '0' || *text > '9')
        return 0;
    for (; *text >= '0' && *text <= '9'; text++) {
        uint32_t digit = (uint32_t)(*text - '0');

        if (sum > (largest - digit) / 10u)
            return 0;
        sum = 10u * sum + digit;
    }
    *value = (int32_t)(negative ? 0u - sum : sum);
    *at = text_skip_blanks(text);
    return 1;
}
