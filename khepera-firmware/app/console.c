#include "app/console.h"

#define BACKSPACE 0x08
#define DELETE    0x7F
#define LARGEST   100000

void console_init(console_t *console)
{
    console->length = 0;
    console->overlong = 0;
    console->line[0] = '\0';
}

static console_event_t end_of_line(console_t *console)
{
    console_event_t event = console->length > 0 ? CONSOLE_LINE : CONSOLE_NOTHING;

    if (console->overlong)
        event = CONSOLE_TOO_LONG;
    console->line[console->length] = '\0';
    console->length = 0;
    console->overlong = 0;
    return event;
}

console_event_t console_take(console_t *console, uint8_t character)
{
    if (character == '\r' || character == '\n')
        return end_of_line(console);
    if (character == BACKSPACE || character == DELETE) {
        if (console->length > 0)
            console->length--;
    } else if (character < ' ') {
        return CONSOLE_NOTHING;
    } else if (console->length == CONSOLE_LINE_MAX) {
        console->overlong = 1;
    } else {
        console->line[console->length++] = (char)character;
    }
    return CONSOLE_NOTHING;
}

static const char *skip_blanks(const char *text)
{
    while (*text == ' ')
        text++;
    return text;
}

int console_word(const char *line, const char *word, const char **rest)
{
    line = skip_blanks(line);
    while (*word != '\0' && *line == *word) {
        line++;
        word++;
    }
    if (*word != '\0' || (*line != '\0' && *line != ' '))
        return 0;
    *rest = skip_blanks(line);
    return 1;
}

int console_number(const char *text, int32_t *value)
{
    int negative = 0;
    int32_t sum = 0;

    text = skip_blanks(text);
    if (*text == '-' || *text == '+')
        negative = *text++ == '-';
    if (*text < '0' || *text > '9')
        return 0;
    for (; *text >= '0' && *text <= '9'; text++) {
        sum = 10 * sum + (*text - '0');
        if (sum > LARGEST)
            return 0;
    }
    if (*skip_blanks(text) != '\0')
        return 0;
    *value = negative ? -sum : sum;
    return 1;
}
