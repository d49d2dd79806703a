/* The serial console's lines: takes characters, hands out whole lines; edits them for people.
 *
 * Raw (as after a reset): no echo, no prompt; for programs, K-Team's clients among them.
 * Interactive: echo, prompt, cursor keys, history, completion. A terminal changes to it by a Tab or
 * a cursor key (no client of K-Team's protocol sends one), and back by a line that begins with a
 * capital, which is never echoed.
 *
 *   ends a line   CR, LF or CR LF; an empty line is nothing
 *   edits         left right home end backspace delete, ^A ^B ^D ^E ^F ^K ^U ^W
 *   recalls       up down, ^P ^N
 *   completes     Tab
 *   gives up      ^C
 *
 * Raw, only backspace and Delete of these edit. Other control characters are ignored. A line too
 * long is dropped whole, and so is one in which a character is missing. */
#ifndef APP_LINE_EDITOR_H
#define APP_LINE_EDITOR_H

#include <stdint.h>

#define LINE_MAX_LENGTH   127u
#define LINE_HISTORY_SIZE 16u

typedef enum {
    LINE_NOTHING = 0,  /* the line goes on */
    LINE_WHOLE = 1,    /* line_editor_t.text holds a line, NUL-terminated, until the next call */
    LINE_TOO_LONG = 2, /* a line of more than LINE_MAX_LENGTH characters ended; it is gone */
    LINE_DAMAGED = 3   /* a line ended of which characters are missing: it must not be obeyed */
} line_event_t;

/* What the editor needs of its surroundings. */
typedef struct {
    void *context;
    void (*write)(void *context, char character);
    /* The word number `index` that may stand at line[word..], or NULL after the last one. */
    const char *(*candidate)(void *context, const char *line, unsigned word, unsigned index);
} line_terminal_t;

typedef struct {
    const line_terminal_t *terminal;
    char text[LINE_MAX_LENGTH + 1];
    uint8_t length;
    uint8_t cursor;
    uint8_t overlong;
    uint8_t damaged; /* a SCI_DAMAGED came */
    uint8_t ended;   /* `text` was handed out: the next character begins a new line */
    uint8_t after_cr;
    uint8_t interactive;
    uint8_t escape; /* state within an escape sequence */
    char parameter; /* ... its last digit */
    char history[LINE_HISTORY_SIZE][LINE_MAX_LENGTH + 1];
    uint8_t history_count; /* saturates at LINE_HISTORY_SIZE */
    uint8_t history_next;  /* where the next line goes */
    uint8_t recalled;      /* lines back from the newest; 0 = the line being typed */
} line_editor_t;

/* `terminal` must outlive the editor. */
void line_editor_init(line_editor_t *editor, const line_terminal_t *terminal);

line_event_t line_editor_take(line_editor_t *editor, uint8_t character);

/* Interactive only: print the prompt, and what has been typed after it. */
void line_editor_prompt(line_editor_t *editor);

/* Interactive or raw. */
void line_editor_set_interactive(line_editor_t *editor, int interactive);

#endif
