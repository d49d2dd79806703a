/* Formatted text without a C library.
 *
 * Knows %d %u %x %X %s %c %%, a width, `-` and a leading 0; numbers are 32 bits wide. Whatever else
 * follows a % comes out as it is. */
#ifndef APP_FORMAT_H
#define APP_FORMAT_H

#include <stdarg.h>
#include <stdint.h>

#ifdef __GNUC__
#define FORMAT_LIKE_PRINTF(text, first) __attribute__((format(printf, text, first)))
#else
#define FORMAT_LIKE_PRINTF(text, first)
#endif

/* A text of bounded size: always NUL-terminated, what does not fit is cut. */
typedef struct {
    char *at;
    uint16_t size; /* bytes of at[], the NUL included; > 0 */
    uint16_t used; /* characters so far */
} text_t;

/* An empty text in buffer[0..size-1]. */
void text_begin(text_t *text, char *buffer, uint16_t size);
void text_add(text_t *text, const char *format, ...) FORMAT_LIKE_PRINTF(2, 3);
void text_add_arguments(text_t *text, const char *format, va_list arguments);

/* Comparing and reading. */
int text_equal(const char *a, const char *b);
/* 1 if `text` begins with `beginning`. */
int text_begins(const char *text, const char *beginning);
/* 1 if the first word of `line` is `word`; *rest is then what follows it, blanks skipped. */
int text_word(const char *line, const char *word, const char **rest);
const char *text_skip_blanks(const char *text);
/* A whole decimal number of 32 bits at `*at`, blanks around it allowed: 1, *value, and *at behind
 * it (and its blanks); else 0 and nothing changed. */
int text_number(const char **at, int32_t *value);

#endif
