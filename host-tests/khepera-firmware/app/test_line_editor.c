// sources: khepera-firmware/app/line_editor.c khepera-firmware/app/format.c
// includes: khepera-firmware
/* Lines out of characters, their editing, and text. */
#include "app/line_editor.h"

#include <string.h>
#include <unity.h>

#include "app/format.h"

static char echo[4096];
static unsigned echoed;

static void write_echo(void *context, char character)
{
    (void)context;
    TEST_ASSERT_LESS_THAN_UINT(sizeof echo - 1, echoed);
    echo[echoed++] = character;
    echo[echoed] = '\0';
}

static const char *candidate(void *context, const char *line, unsigned word, unsigned index)
{
    static const char *const commands[] = {"help", "status", "start", "stop", "get"};
    static const char *const names[] = {"speed.kp", "speed.ki"};

    (void)context;
    if (word == 0)
        return index < 5 ? commands[index] : NULL;
    return strncmp(line, "get", 3) == 0 && index < 2 ? names[index] : NULL;
}

static const line_terminal_t terminal = {NULL, write_echo, candidate};
static line_editor_t editor;

void setUp(void)
{
    line_editor_init(&editor, &terminal);
    echoed = 0;
    echo[0] = '\0';
}

void tearDown(void) {}

static line_event_t type(const char *characters)
{
    line_event_t event = LINE_NOTHING;

    for (; *characters != '\0'; characters++)
        event = line_editor_take(&editor, (uint8_t)*characters);
    return event;
}

static void check_line(const char *typed, const char *line)
{
    TEST_ASSERT_EQUAL_MESSAGE(LINE_WHOLE, type(typed), typed);
    TEST_ASSERT_EQUAL_STRING(line, editor.text);
}

/* ---- Raw ---- */

static void a_line_with_a_missing_character_is_told_until_it_is_rubbed_out(void)
{
    TEST_ASSERT_EQUAL(LINE_DAMAGED, type("sta\x1Atus\n"));
    check_line("status\n", "status");
    TEST_ASSERT_EQUAL(LINE_DAMAGED, type("ab\x1A\b\n"));
    check_line("ab\x1A\b\bstatus\n", "status");
    TEST_ASSERT_EQUAL_MESSAGE(LINE_NOTHING, type("\x1A\r\n"), "nothing is left to obey");
    check_line("status\n", "status");
}

static void either_end_of_line_gives_the_line(void)
{
    check_line("help\n", "help");
    check_line("stop\r", "stop");
    TEST_ASSERT_EQUAL(LINE_NOTHING, type("\n"));
    check_line("D,1,2\n", "D,1,2");
}

static void empty_lines_are_nothing_and_nothing_is_echoed(void)
{
    TEST_ASSERT_EQUAL(LINE_NOTHING, type("\r\n\r\n\n\r"));
    check_line("D,1,2\r", "D,1,2");
    check_line("status\r", "status");
    TEST_ASSERT_EQUAL_STRING("", echo);
}

static void backspace_rubs_out(void)
{
    check_line("\x08\x7Fstart\x08\x08op\n", "staop");
    TEST_ASSERT_EQUAL_STRING("", echo);
}

static void other_control_characters_are_ignored(void)
{
    check_line("\x07he\x1Blp\x0F\n", "help");
    check_line("D,\x01\x03\x15"
               "1,2\n",
               "D,1,2");
}

static void a_line_too_long_is_dropped_and_the_next_is_whole(void)
{
    char longest[LINE_MAX_LENGTH + 1];

    memset(longest, 'x', LINE_MAX_LENGTH);
    longest[LINE_MAX_LENGTH] = '\0';
    type(longest);
    check_line("\n", longest);
    type(longest);
    TEST_ASSERT_EQUAL(LINE_TOO_LONG, type("y\n"));
    check_line("stop\n", "stop");
}

static void every_byte_value_is_survived(void)
{
    unsigned round;
    unsigned byte;

    for (round = 0; round < 50; round++)
        for (byte = 0; byte < 256; byte++) {
            echoed = 0;
            (void)line_editor_take(&editor, (uint8_t)byte);
        }
    echoed = 0;
    (void)type("\n");
    check_line("status\n", "status");
}

/* ---- Interactive ---- */

static void a_tab_wakes_and_completes(void)
{
    type("he\t");
    TEST_ASSERT_EQUAL(1, editor.interactive);
    TEST_ASSERT_EQUAL_STRING("\r\n> help ", echo);
    check_line("\n", "help ");
}

static void several_candidates_are_completed_as_far_as_they_agree_then_listed(void)
{
    type("\tst");
    echoed = 0;
    type("\t");
    TEST_ASSERT_NOT_NULL(strstr(echo, "status  start  stop"));
    type("a\t");
    TEST_ASSERT_EQUAL_STRING("sta", editor.text);
    type("r\t");
    TEST_ASSERT_EQUAL_STRING("start ", editor.text);
    check_line("\x15get sp\tp\n", "get speed.kp");
}

static void what_fits_nothing_stays(void)
{
    type("\tzz\t");
    TEST_ASSERT_EQUAL_STRING("zz", editor.text);
}

static void cursor_keys_edit_in_the_middle(void)
{
    check_line("\thlp\x1B[D\x1B[De\n", "help");
    check_line("elp\x1B[Hh\n", "help");
    check_line("hexlp\x1B[D\x1B[D\x1B[D\x1B[3~\n", "help");
    check_line("lp\x01he\x05!\x08\n", "help");
    check_line("help xyz\x1B[D\x1B[D\x0B\n", "help x");
    check_line("stop now\x17\x17help\n", "help");
}

static void history_goes_back_and_forth(void)
{
    check_line("\tone\n", "one");
    check_line("two\n", "two");
    check_line("two\n", "two");
    check_line("\x1B[A\n", "two");
    check_line("\x1B[A\x1B[A\n", "one");
    check_line("\x10\x10\x0E\n", "one");
    type("\x1B[A\x1B[B");
    TEST_ASSERT_EQUAL_STRING("", editor.text);
}

static void history_keeps_the_last_lines(void)
{
    char line[8] = "line-a\n";
    unsigned i;

    type("\t");
    for (i = 0; i < LINE_HISTORY_SIZE + 5; i++) {
        line[5] = (char)('a' + i);
        type(line);
    }
    for (i = 0; i < LINE_HISTORY_SIZE + 5; i++)
        type("\x1B[A");
    check_line("\n", "line-f");
}

static void a_capital_is_never_echoed_and_ends_it(void)
{
    type("\t");
    echoed = 0;
    echo[0] = '\0';
    check_line("D,1,2\r", "D,1,2");
    TEST_ASSERT_EQUAL_STRING("", echo);
    TEST_ASSERT_EQUAL(0, editor.interactive);
}

static void a_client_half_way_through_a_command_is_not_disturbed(void)
{
    check_line("D,1\t\x1B[A,2\n", "D,1,2");
    TEST_ASSERT_EQUAL_STRING("", echo);
    TEST_ASSERT_EQUAL(0, editor.interactive);
}

static void control_c_gives_a_line_up(void)
{
    type("\thel\x03");
    check_line("stop\n", "stop");
}

/* ---- Text ---- */

static void format(char *buffer, uint16_t size, const char *text_format, ...)
    FORMAT_LIKE_PRINTF(3, 4);
static void format(char *buffer, uint16_t size, const char *text_format, ...)
{
    va_list arguments;
    text_t text;

    text_begin(&text, buffer, size);
    va_start(arguments, text_format);
    text_add_arguments(&text, text_format, arguments);
    va_end(arguments);
}

static void numbers_are_formatted(void)
{
    char buffer[64];

    format(buffer, sizeof buffer, "%d %d %u %04X %x|%5d|%-5d|%05d|", INT32_MIN, 0, 4294967295u,
           0xBEEFu, 0xafu, -42, -42, -42);
    TEST_ASSERT_EQUAL_STRING("-2147483648 0 4294967295 BEEF af|  -42|-42  |-0042|", buffer);
    format(buffer, sizeof buffer, "%s|%-4s|%4s|%c%%", "text", "ab", "ab", 'c');
    TEST_ASSERT_EQUAL_STRING("text|ab  |  ab|c%", buffer);
}

static void what_does_not_fit_is_cut(void)
{
    char buffer[8];
    text_t text;

    text_begin(&text, buffer, sizeof buffer);
    text_add(&text, "%s", "12345");
    text_add(&text, "%d", 6789);
    TEST_ASSERT_EQUAL_STRING("1234567", buffer);
}

static void a_word_must_match_whole(void)
{
    const char *rest = NULL;

    TEST_ASSERT_TRUE(text_word("  start   42", "start", &rest));
    TEST_ASSERT_EQUAL_STRING("42", rest);
    TEST_ASSERT_FALSE(text_word("stopp", "stop", &rest));
    TEST_ASSERT_FALSE(text_word("sto", "stop", &rest));
    TEST_ASSERT_FALSE(text_word("", "stop", &rest));
}

static void numbers_are_whole_or_refused(void)
{
    static const char *const wrong[] = {
        "", "-", "x", "--1", "2147483648", "-2147483649", "99999999999999999999"};
    int32_t value = 7;
    unsigned i;

    for (i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        const char *at = wrong[i];

        TEST_ASSERT_FALSE_MESSAGE(text_number(&at, &value), wrong[i]);
        TEST_ASSERT_EQUAL_PTR(wrong[i], at);
    }
    TEST_ASSERT_EQUAL_INT32(7, value);
    {
        const char *at = " -2147483648 ,5";

        TEST_ASSERT_TRUE(text_number(&at, &value));
        TEST_ASSERT_EQUAL_INT32(INT32_MIN, value);
        TEST_ASSERT_EQUAL_STRING(",5", at);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_line_with_a_missing_character_is_told_until_it_is_rubbed_out);
    RUN_TEST(either_end_of_line_gives_the_line);
    RUN_TEST(empty_lines_are_nothing_and_nothing_is_echoed);
    RUN_TEST(backspace_rubs_out);
    RUN_TEST(other_control_characters_are_ignored);
    RUN_TEST(a_line_too_long_is_dropped_and_the_next_is_whole);
    RUN_TEST(every_byte_value_is_survived);
    RUN_TEST(a_tab_wakes_and_completes);
    RUN_TEST(several_candidates_are_completed_as_far_as_they_agree_then_listed);
    RUN_TEST(what_fits_nothing_stays);
    RUN_TEST(cursor_keys_edit_in_the_middle);
    RUN_TEST(history_goes_back_and_forth);
    RUN_TEST(history_keeps_the_last_lines);
    RUN_TEST(a_capital_is_never_echoed_and_ends_it);
    RUN_TEST(a_client_half_way_through_a_command_is_not_disturbed);
    RUN_TEST(control_c_gives_a_line_up);
    RUN_TEST(numbers_are_formatted);
    RUN_TEST(what_does_not_fit_is_cut);
    RUN_TEST(a_word_must_match_whole);
    RUN_TEST(numbers_are_whole_or_refused);
    return UNITY_END();
}
