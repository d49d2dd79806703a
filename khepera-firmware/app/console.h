/* The serial console: takes characters, hands out whole lines.
 *
 * A line ends with CR or LF; empty lines are ignored (so CR LF is one end). Backspace and DEL rub
 * out. Other control characters are ignored. A line that is too long is dropped whole. */
#ifndef APP_CONSOLE_H
#define APP_CONSOLE_H

#include <stdint.h>

#define CONSOLE_LINE_MAX 79u

typedef enum {
    CONSOLE_NOTHING = 0, /* the line goes on */
    CONSOLE_LINE = 1,    /* console_t.line holds a line, NUL-terminated, until the next call */
    CONSOLE_TOO_LONG = 2 /* a line of more than CONSOLE_LINE_MAX characters ended; it is gone */
} console_event_t;

typedef struct {
    char line[CONSOLE_LINE_MAX + 1];
    uint8_t length;
    uint8_t overlong;
} console_t;

void console_init(console_t *console);
console_event_t console_take(console_t *console, uint8_t character);

/* 1 if the line's first word is `word`; *rest is then what follows it, blanks skipped. */
int console_word(const char *line, const char *word, const char **rest);

/* A whole decimal number, nothing after it but blanks: 1 and *value, else 0. Range +-100000. */
int console_number(const char *text, int32_t *value);

#endif
