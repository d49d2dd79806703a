// sources: khepera-firmware/app/console.c khepera-firmware/app/text.c
// includes: khepera-firmware
/* Lines out of characters, and words and numbers out of lines. */
#include "app/console.h"

#include <string.h>
#include <unity.h>

#include "app/text.h"

static console_t console;

void setUp(void)
{
    console_init(&console);
}

void tearDown(void) {}

static console_event_t type(const char *characters)
{
    console_event_t event = CONSOLE_NOTHING;

    for (; *characters != '\0'; characters++)
        event = console_take(&console, (uint8_t)*characters);
    return event;
}

static void either_end_of_line_gives_the_line(void)
{
    TEST_ASSERT_EQUAL(CONSOLE_LINE, type("help\n"));
    TEST_ASSERT_EQUAL_STRING("help", console.line);
    TEST_ASSERT_EQUAL(CONSOLE_LINE, type("stop\r"));
    TEST_ASSERT_EQUAL_STRING("stop", console.line);
}

static void empty_lines_say_nothing(void)
{
    TEST_ASSERT_EQUAL(CONSOLE_NOTHING, type("\r\n\r\n"));
    TEST_ASSERT_EQUAL(CONSOLE_LINE, type("help\r"));
    TEST_ASSERT_EQUAL(CONSOLE_NOTHING, type("\n"));
}

static void backspace_rubs_out(void)
{
    type("\x08\x7Fstart\x08\x08op\n");
    TEST_ASSERT_EQUAL_STRING("staop", console.line);
}

static void control_characters_are_ignored(void)
{
    type("\x01he\x1Blp\x07\n");
    TEST_ASSERT_EQUAL_STRING("help", console.line);
}

static void a_line_too_long_is_dropped_and_the_next_is_whole(void)
{
    char longest[CONSOLE_LINE_MAX + 1];

    memset(longest, 'x', CONSOLE_LINE_MAX);
    longest[CONSOLE_LINE_MAX] = '\0';
    type(longest);
    TEST_ASSERT_EQUAL(CONSOLE_LINE, type("\n"));
    TEST_ASSERT_EQUAL_STRING(longest, console.line);
    type(longest);
    TEST_ASSERT_EQUAL(CONSOLE_TOO_LONG, type("y\n"));
    TEST_ASSERT_EQUAL(CONSOLE_LINE, type("stop\n"));
    TEST_ASSERT_EQUAL_STRING("stop", console.line);
}

static void every_byte_value_is_survived(void)
{
    unsigned round;
    unsigned byte;

    for (round = 0; round < 50; round++)
        for (byte = 0; byte < 256; byte++)
            (void)console_take(&console, (uint8_t)byte);
    (void)type("\n");
    TEST_ASSERT_EQUAL(CONSOLE_LINE, type("status\n"));
    TEST_ASSERT_EQUAL_STRING("status", console.line);
}

static void a_word_must_match_whole(void)
{
    const char *rest = NULL;

    TEST_ASSERT_TRUE(console_word("  start   42", "start", &rest));
    TEST_ASSERT_EQUAL_STRING("42", rest);
    TEST_ASSERT_TRUE(console_word("stop", "stop", &rest));
    TEST_ASSERT_EQUAL_STRING("", rest);
    TEST_ASSERT_FALSE(console_word("stopp", "stop", &rest));
    TEST_ASSERT_FALSE(console_word("sto", "stop", &rest));
    TEST_ASSERT_FALSE(console_word("", "stop", &rest));
}

static void numbers_are_whole_or_refused(void)
{
    static const char *const wrong[] = {
        "", "-", "1x", "x", "4 5", "1.5", "--1", "100001", "99999999999999999999"};
    int32_t value = 7;
    unsigned i;

    TEST_ASSERT_TRUE(console_number("-180 ", &value));
    TEST_ASSERT_EQUAL_INT32(-180, value);
    TEST_ASSERT_TRUE(console_number("+90", &value));
    TEST_ASSERT_EQUAL_INT32(90, value);
    for (i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        TEST_ASSERT_FALSE_MESSAGE(console_number(wrong[i], &value), wrong[i]);
    TEST_ASSERT_EQUAL_INT32(90, value);
}

static void text_is_put_together_and_cut(void)
{
    char buffer[20];
    text_t text;

    text_begin(&text, buffer, sizeof buffer);
    text_add_decimal(&text, INT32_MIN);
    text_add(&text, " ");
    text_add_hex(&text, 0xBEEF, 4);
    TEST_ASSERT_EQUAL_STRING("-2147483648 BEEF", buffer);
    text_add(&text, " and more");
    TEST_ASSERT_EQUAL_STRING("-2147483648 BEEF an", buffer);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(either_end_of_line_gives_the_line);
    RUN_TEST(empty_lines_say_nothing);
    RUN_TEST(backspace_rubs_out);
    RUN_TEST(control_characters_are_ignored);
    RUN_TEST(a_line_too_long_is_dropped_and_the_next_is_whole);
    RUN_TEST(every_byte_value_is_survived);
    RUN_TEST(a_word_must_match_whole);
    RUN_TEST(numbers_are_whole_or_refused);
    RUN_TEST(text_is_put_together_and_cut);
    return UNITY_END();
}
