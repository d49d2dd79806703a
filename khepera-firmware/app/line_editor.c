#include "app/line_editor.h"

#include <stddef.h>

#include "app/format.h"
#include "drivers/sci.h"

#define CONTROL(letter) ((letter)-64)
#define ESCAPE          0x1B
#define DELETE          0x7F
#define PROMPT          "> "

enum { ESCAPE_NONE, ESCAPE_BEGUN, ESCAPE_SEQUENCE };

static void put(const line_editor_t *editor, char character)
{
    editor->terminal->write(editor->terminal->context, character);
}

static void put_string(const line_editor_t *editor, const char *string)
{
    while (*string != '\0')
        put(editor, *string++);
}

static void put_times(const line_editor_t *editor, char character, unsigned times)
{
    for (; times > 0; times--)
        put(editor, character);
}

void line_editor_init(line_editor_t *editor, const line_terminal_t *terminal)
{
    editor->terminal = terminal;
    editor->text[0] = '\0';
    editor->length = editor->cursor = editor->overlong = editor->ended = editor->damaged = 0;
    editor->after_cr = editor->interactive = editor->escape = 0;
    editor->parameter = '\0';
    editor->history_count = editor->history_next = editor->recalled = 0;
}

void line_editor_prompt(line_editor_t *editor)
{
    if (!editor->interactive)
        return;
    put_string(editor, PROMPT);
    if (editor->ended)
        return;
    put_string(editor, editor->text);
    put_times(editor, '\b', (unsigned)editor->length - editor->cursor);
}

void line_editor_set_interactive(line_editor_t *editor, int interactive)
{
    editor->interactive = (uint8_t)(interactive != 0);
}

static void begin_line(line_editor_t *editor)
{
    editor->text[0] = '\0';
    editor->length = editor->cursor = editor->overlong = editor->ended = editor->damaged = 0;
    editor->recalled = 0;
}

/* ---- Changing the line ---- */

/* Show what stands from the cursor on, `gone` characters fewer than before. */
static void show_rest(const line_editor_t *editor, unsigned gone)
{
    put_string(editor, &editor->text[editor->cursor]);
    put_times(editor, ' ', gone);
    put_times(editor, '\b', (unsigned)editor->length - editor->cursor + gone);
}

static void remove_before(line_editor_t *editor, unsigned count)
{
    unsigned i;

    if (count > editor->cursor)
        count = editor->cursor;
    editor->cursor = (uint8_t)(editor->cursor - count);
    editor->length = (uint8_t)(editor->length - count);
    for (i = editor->cursor; i <= editor->length; i++)
        editor->text[i] = editor->text[i + count];
    if (editor->length == 0)
        editor->damaged = 0; /* nothing is left of what was */
    if (editor->interactive) {
        put_times(editor, '\b', count);
        show_rest(editor, count);
    }
}

static void insert(line_editor_t *editor, char character)
{
    unsigned i;

    if (editor->length == LINE_MAX_LENGTH) {
        editor->overlong = 1;
        return;
    }
    for (i = editor->length; i > editor->cursor; i--)
        editor->text[i] = editor->text[i - 1];
    editor->text[editor->cursor++] = character;
    editor->text[++editor->length] = '\0';
    /* K-Team's client must not read its own command. */
    if (editor->text[0] >= 'A' && editor->text[0] <= 'Z')
        editor->interactive = 0;
    if (editor->interactive) {
        put(editor, character);
        show_rest(editor, 0);
    }
}

static void move_to(line_editor_t *editor, unsigned cursor)
{
    if (cursor > editor->length)
        cursor = editor->length;
    if (editor->interactive) {
        for (; editor->cursor > cursor; editor->cursor--)
            put(editor, '\b');
        for (; editor->cursor < cursor; editor->cursor++)
            put(editor, editor->text[editor->cursor]);
    }
    editor->cursor = (uint8_t)cursor;
}

static void replace(line_editor_t *editor, const char *text)
{
    move_to(editor, editor->length);
    remove_before(editor, editor->length);
    editor->overlong = 0;
    while (*text != '\0')
        insert(editor, *text++);
}

static void remove_word(line_editor_t *editor)
{
    unsigned start = editor->cursor;

    while (start > 0 && editor->text[start - 1] == ' ')
        start--;
    while (start > 0 && editor->text[start - 1] != ' ')
        start--;
    remove_before(editor, editor->cursor - start);
}

static void remove_at_cursor(line_editor_t *editor)
{
    if (editor->cursor == editor->length)
        return;
    move_to(editor, editor->cursor + 1u);
    remove_before(editor, 1);
}

/* ---- History ---- */

static const char *history_line(const line_editor_t *editor, unsigned back)
{
    return editor->history[(editor->history_next + LINE_HISTORY_SIZE - back) % LINE_HISTORY_SIZE];
}

static void remember(line_editor_t *editor)
{
    unsigned i;

    if (editor->history_count > 0 && text_equal(history_line(editor, 1), editor->text))
        return;
    for (i = 0; i <= editor->length; i++)
        editor->history[editor->history_next][i] = editor->text[i];
    editor->history_next = (uint8_t)((editor->history_next + 1u) % LINE_HISTORY_SIZE);
    if (editor->history_count < LINE_HISTORY_SIZE)
        editor->history_count++;
}

static void recall(line_editor_t *editor, int direction)
{
    unsigned back = editor->recalled;

    if (direction > 0 && back < editor->history_count)
        back++;
    else if (direction < 0 && back > 0)
        back--;
    else
        return;
    replace(editor, back == 0 ? "" : history_line(editor, back));
    editor->recalled = (uint8_t)back;
}

/* ---- Completion ---- */

static unsigned word_start(const line_editor_t *editor)
{
    unsigned start = editor->cursor;

    while (start > 0 && editor->text[start - 1] != ' ' && editor->text[start - 1] != ',')
        start--;
    return start;
}

/* Whether the candidate goes on from what stands between `start` and the cursor. */
static int fits(const line_editor_t *editor, const char *candidate, unsigned start)
{
    unsigned i;

    for (i = start; i < editor->cursor; i++)
        if (candidate[i - start] != editor->text[i])
            return 0;
    return 1;
}

static void list_candidates(line_editor_t *editor, unsigned start)
{
    const char *candidate;
    unsigned i;

    put_string(editor, "\r\n");
    for (i = 0; (candidate = editor->terminal->candidate(editor->terminal->context, editor->text,
                                                         start, i)) != NULL;
         i++) {
        if (!fits(editor, candidate, start))
            continue;
        put_string(editor, candidate);
        put_string(editor, "  ");
    }
    put_string(editor, "\r\n");
    line_editor_prompt(editor);
}

static void complete(line_editor_t *editor)
{
    unsigned start = word_start(editor);
    unsigned typed = editor->cursor - start;
    unsigned common = 0;
    unsigned found = 0;
    const char *first = NULL;
    const char *candidate;
    unsigned i;

    for (i = 0; (candidate = editor->terminal->candidate(editor->terminal->context, editor->text,
                                                         start, i)) != NULL;
         i++) {
        unsigned same = 0;

        if (!fits(editor, candidate, start))
            continue;
        if (found++ == 0) {
            first = candidate;
            while (first[common] != '\0')
                common++;
        }
        while (same < common && candidate[same] == first[same])
            same++;
        common = same;
    }
    if (found == 0)
        return;
    for (i = typed; i < common; i++)
        insert(editor, first[i]);
    if (found == 1)
        insert(editor, ' ');
    else if (common <= typed)
        list_candidates(editor, start);
}

/* ---- Characters ---- */

/* A key that only people have: change to interactive, unless K-Team's client is half-way through a
 * command. */
static int wake_up(line_editor_t *editor)
{
    if (editor->interactive)
        return 1;
    if (editor->length > 0 && !(editor->text[0] >= 'a' && editor->text[0] <= 'z'))
        return 0;
    editor->interactive = 1;
    put_string(editor, "\r\n");
    line_editor_prompt(editor);
    return 1;
}

static line_event_t end_of_line(line_editor_t *editor)
{
    if (editor->interactive)
        put_string(editor, "\r\n");
    editor->ended = 1;
    if (editor->overlong)
        return LINE_TOO_LONG;
    if (editor->length == 0) {
        line_editor_prompt(editor);
        return LINE_NOTHING;
    }
    if (editor->interactive)
        remember(editor);
    return editor->damaged ? LINE_DAMAGED : LINE_WHOLE;
}

static void sequence(line_editor_t *editor, char final)
{
    if (!wake_up(editor))
        return;
    switch (final) {
    case 'A':
        recall(editor, 1);
        break;
    case 'B':
        recall(editor, -1);
        break;
    case 'C':
        move_to(editor, editor->cursor + 1u);
        break;
    case 'D':
        move_to(editor, editor->cursor > 0 ? editor->cursor - 1u : 0);
        break;
    case 'H':
        move_to(editor, 0);
        break;
    case 'F':
        move_to(editor, editor->length);
        break;
    case '~':
        if (editor->parameter == '3')
            remove_at_cursor(editor);
        else if (editor->parameter == '1' || editor->parameter == '7')
            move_to(editor, 0);
        else if (editor->parameter == '4' || editor->parameter == '8')
            move_to(editor, editor->length);
        break;
    default:
        break;
    }
}

/* Returns 1 if the character belongs to an escape sequence. */
static int take_escape(line_editor_t *editor, uint8_t character)
{
    if (character == ESCAPE) {
        editor->escape = ESCAPE_BEGUN;
        return 1;
    }
    if (editor->escape == ESCAPE_NONE)
        return 0;
    if (editor->escape == ESCAPE_BEGUN) {
        int goes_on = character == '[' || character == 'O';

        editor->parameter = '\0';
        editor->escape = goes_on ? ESCAPE_SEQUENCE : ESCAPE_NONE;
        return goes_on;
    }
    if ((character >= '0' && character <= '9') || character == ';') {
        editor->parameter = (char)character;
        return 1;
    }
    editor->escape = ESCAPE_NONE;
    if (character < 0x40 || character > 0x7E)
        return 0;
    sequence(editor, (char)character);
    return 1;
}

static void take_control(line_editor_t *editor, uint8_t character)
{
    /* Of a program's rubbish only what rubs out means anything. */
    if (!editor->interactive && character != '\t' && character != '\b' && character != DELETE)
        return;
    switch (character) {
    case '\t':
        if (wake_up(editor))
            complete(editor);
        break;
    case '\b':
    case DELETE:
        remove_before(editor, 1);
        break;
    case CONTROL('A'):
        move_to(editor, 0);
        break;
    case CONTROL('B'):
        move_to(editor, editor->cursor > 0 ? editor->cursor - 1u : 0);
        break;
    case CONTROL('C'):
        if (editor->interactive)
            put_string(editor, "^C\r\n");
        begin_line(editor);
        line_editor_prompt(editor);
        break;
    case CONTROL('D'):
        remove_at_cursor(editor);
        break;
    case CONTROL('E'):
        move_to(editor, editor->length);
        break;
    case CONTROL('F'):
        move_to(editor, editor->cursor + 1u);
        break;
    case CONTROL('K'):
        while (editor->cursor < editor->length)
            remove_at_cursor(editor);
        break;
    case CONTROL('N'):
        recall(editor, -1);
        break;
    case CONTROL('P'):
        recall(editor, 1);
        break;
    case CONTROL('U'):
        remove_before(editor, editor->cursor);
        break;
    case CONTROL('W'):
        remove_word(editor);
        break;
    default:
        break;
    }
}

line_event_t line_editor_take(line_editor_t *editor, uint8_t character)
{
    uint8_t after_cr = editor->after_cr;

    editor->after_cr = character == '\r';
    if (character == '\n' && after_cr)
        return LINE_NOTHING;
    if (editor->ended)
        begin_line(editor);
    if (character == SCI_DAMAGED) {
        editor->damaged = 1;
        editor->escape = ESCAPE_NONE;
        return LINE_NOTHING;
    }
    if (take_escape(editor, character))
        return LINE_NOTHING;
    if (character == '\r' || character == '\n')
        return end_of_line(editor);
    if (character < ' ' || character == DELETE)
        take_control(editor, character);
    else
        insert(editor, (char)character);
    return LINE_NOTHING;
}
