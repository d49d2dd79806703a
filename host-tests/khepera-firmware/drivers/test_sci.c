// sources: khepera-firmware/drivers/sci.c khepera-firmware/drivers/motors.c
// sources: host-tests/khepera-firmware/fakes/chip.c
// includes: host-tests/khepera-firmware/fakes khepera-firmware
/* The serial line: queues, flow control, baud rates, the emergency stop's word. */
#include "drivers/sci.h"

#include <string.h>
#include <unity.h>

#include "board/mc68331.h"
#include "drivers/interrupts.h"

volatile uint8_t interrupts_work;
void sci_isr(void);

void setUp(void)
{
    unsigned i;

    /* The driver's state outlives a test: empty its queues, end the line, release both sides. */
    for (i = 0; i < 2; i++) {
        while (sci_read() >= 0) {
        }
        SCSR = SCSR_RDRF;
        SCDR = '\n';
        sci_isr();
    }
    (void)sci_read();
    while (!sci_sent()) {
        SCSR = SCSR_TDRE | SCSR_TC;
        sci_isr();
    }
    (void)sci_take_stop_word();
    memset(fake_registers, 0, sizeof fake_registers);
    interrupts_work = 0;
    sci_init(9600);
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(0, fake_masked, "interrupts left masked");
}

static void receive(uint8_t character)
{
    SCSR = SCSR_RDRF;
    SCDR = character;
    sci_isr();
}

static void receive_string(const char *string)
{
    while (*string != '\0')
        receive((uint8_t)*string++);
}

/* What the transmitter takes when it is empty, or -1. */
static int transmitted(void)
{
    if (!(SCCR1 & SCCR1_TIE))
        return -1;
    SCSR = SCSR_TDRE;
    SCDR = 0xFFFF;
    sci_isr();
    return SCDR == 0xFFFF ? -1 : SCDR;
}

static void the_divider_is_the_nearest(void)
{
    static const struct {
        uint32_t baud;
        uint16_t divider;
    } rates[] = {{9600, 82}, {19200, 41}, {38400, 20}, {115200, 7}};
    unsigned i;

    for (i = 0; i < 4; i++) {
        sci_init(rates[i].baud);
        TEST_ASSERT_EQUAL_UINT16(rates[i].divider, SCCR0);
    }
}

static void characters_come_in_order_and_leave_work(void)
{
    TEST_ASSERT_EQUAL(-1, sci_read());
    receive_string("ab");
    TEST_ASSERT_EQUAL_UINT8(1, interrupts_work);
    TEST_ASSERT_EQUAL('a', sci_read());
    TEST_ASSERT_EQUAL('b', sci_read());
    TEST_ASSERT_EQUAL(-1, sci_read());
}

static void all_that_is_written_goes_out_and_then_the_interrupt_rests(void)
{
    sci_write("xyz", 3);
    TEST_ASSERT_EQUAL(0, sci_sent());
    TEST_ASSERT_EQUAL('x', transmitted());
    TEST_ASSERT_EQUAL('y', transmitted());
    TEST_ASSERT_EQUAL('z', transmitted());
    TEST_ASSERT_EQUAL(-1, transmitted());
    TEST_ASSERT_EQUAL_UINT16(0, SCCR1 & SCCR1_TIE);
    SCSR = SCSR_TDRE;
    TEST_ASSERT_EQUAL_MESSAGE(0, sci_sent(), "the last character is still on the wire");
    SCSR = SCSR_TDRE | SCSR_TC;
    TEST_ASSERT_EQUAL(1, sci_sent());
}

static void what_does_not_fit_is_cut(void)
{
    static char much[SCI_TX_SIZE - 1];
    unsigned i;

    memset(much, 'm', sizeof much);
    sci_write(much, sizeof much);
    TEST_ASSERT_EQUAL_UINT32(1, sci_room());
    sci_write("12", 2);
    TEST_ASSERT_EQUAL_UINT32(0, sci_room());
    for (i = 0; i < sizeof much; i++)
        TEST_ASSERT_EQUAL('m', transmitted());
    TEST_ASSERT_EQUAL('1', transmitted());
    TEST_ASSERT_EQUAL(-1, transmitted());
}

static void receive_with(uint8_t character, uint16_t flags)
{
    SCSR = (uint16_t)(SCSR_RDRF | flags);
    SCDR = character;
    sci_isr();
}

static void check_read(const char *expected)
{
    for (; *expected != '\0'; expected++)
        TEST_ASSERT_EQUAL_HEX8(*expected, sci_read());
    TEST_ASSERT_EQUAL(-1, sci_read());
}

static void damaged_and_lost_characters_leave_a_mark_in_their_line(void)
{
    uint16_t before = sci_losses();

    receive('D');
    receive_with('1', SCSR_FE);
    receive_with('2', SCSR_NF);
    receive_string("3\n");
    check_read("D\x1A"
               "3\n");
    receive_with('E', SCSR_OR); /* the one after it is lost */
    receive('\n');
    check_read("E\x1A\n");
    receive_string("H\n");
    check_read("H\n");
    TEST_ASSERT_EQUAL_UINT16(before + 3, sci_losses());
}

static void what_is_damaged_between_lines_marks_the_next_one_unless_the_line_rested(void)
{
    receive_with(0, SCSR_FE);
    receive_string("H\n");
    check_read("\x1AH\n");
    receive_with(0, SCSR_FE);
    receive_with(0, SCSR_FE | SCSR_IDLE);
    receive_with('H', SCSR_IDLE);
    receive('\n');
    check_read("H\n");
    receive('H');
    receive_with(0, SCSR_FE);
    receive_with('\n', SCSR_IDLE);
    check_read("H\x1A\n");
}

static void a_full_queue_marks_the_line_that_it_cuts(void)
{
    uint32_t i;

    for (i = 0; i < SCI_RX_SIZE; i++)
        receive('q');
    receive_string("lost");
    for (i = 0; i < 100; i++)
        TEST_ASSERT_EQUAL('q', sci_read());
    receive_string("kept\n");
    for (i = 100; i < SCI_RX_SIZE; i++)
        TEST_ASSERT_EQUAL('q', sci_read());
    check_read("\x1Akept\n");
}

static void a_paste_of_64_kib_loses_nothing_though_nobody_reads(void)
{
    uint16_t before = sci_losses();
    uint32_t i;

    for (i = 0; i < 65536; i++)
        receive((uint8_t)('a' + i % 26));
    for (i = 0; i < 65536; i++)
        TEST_ASSERT_EQUAL('a' + i % 26, sci_read());
    TEST_ASSERT_EQUAL_UINT16(before, sci_losses());
}

static void a_full_queue_stops_the_sender_in_time_and_lets_him_go_on(void)
{
    uint32_t i = 0;

    while (transmitted() != SCI_XOFF) {
        receive('q');
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(SCI_RX_SIZE * 3 / 4, ++i);
    }
    TEST_ASSERT_EQUAL_UINT32(SCI_RX_SIZE * 3 / 4, i);
    for (; i < SCI_RX_SIZE; i++)
        receive('q');
    TEST_ASSERT_EQUAL_MESSAGE(-1, transmitted(), "XOFF once");
    receive('!');
    for (i = 0; i < SCI_RX_SIZE; i++) {
        TEST_ASSERT_EQUAL('q', sci_read());
        if (i + 1 < SCI_RX_SIZE * 3 / 4)
            TEST_ASSERT_EQUAL(-1, transmitted());
        else if (i + 1 == SCI_RX_SIZE * 3 / 4)
            TEST_ASSERT_EQUAL(SCI_XON, transmitted());
    }
    TEST_ASSERT_EQUAL_MESSAGE(-1, sci_read(), "one too many is lost, and no other");
}

static void xoff_holds_our_answers_until_xon_or_anything_else(void)
{
    static const uint8_t releases[] = {SCI_XON, 'a'};
    unsigned i;

    for (i = 0; i < 2; i++) {
        setUp();
        receive(SCI_XOFF);
        sci_write("ok", 2);
        TEST_ASSERT_EQUAL(-1, transmitted());
        receive(releases[i]);
        TEST_ASSERT_EQUAL('o', transmitted());
        TEST_ASSERT_EQUAL('k', transmitted());
    }
    TEST_ASSERT_EQUAL('a', sci_read());
    TEST_ASSERT_EQUAL_MESSAGE(-1, sci_read(), "XON and XOFF are not handed on");
}

static void our_own_xoff_goes_out_though_we_are_held(void)
{
    uint32_t i;

    receive(SCI_XOFF);
    for (i = 0; i < SCI_RX_SIZE * 3 / 4; i++) {
        receive('q');
        receive(SCI_XOFF);
    }
    TEST_ASSERT_EQUAL(SCI_XOFF, transmitted());
}

static void a_new_rate_waits_until_all_is_sent(void)
{
    sci_write("ab", 2);
    sci_set_baud(38400);
    sci_poll();
    TEST_ASSERT_EQUAL_UINT16(82, SCCR0);
    (void)transmitted();
    (void)transmitted();
    (void)transmitted();
    sci_poll();
    TEST_ASSERT_EQUAL_UINT16(82, SCCR0);
    SCSR = SCSR_TDRE | SCSR_TC;
    sci_poll();
    TEST_ASSERT_EQUAL_UINT16(20, SCCR0);
}

static void check_stop(const char *stream, int stops)
{
    setUp();
    PWMAB = 0x7F7F;
    receive_string(stream);
    TEST_ASSERT_EQUAL_MESSAGE(stops, sci_take_stop_word(), stream);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(stops ? 0 : 0x7F7F, PWMAB, stream);
    TEST_ASSERT_EQUAL_MESSAGE(0, sci_take_stop_word(), stream);
}

static void estop_turns_the_motors_off_wherever_it_stands(void)
{
    check_stop("estop", 1);
    check_stop("D,10,1estop", 1);
    check_stop("eestop", 1);
    check_stop("esestop", 1);
    check_stop("estoestop", 1);
    check_stop("set estop", 1);
    check_stop("stop estp esto p ESTOP", 0);
}

static void estop_works_though_the_queue_is_full(void)
{
    uint32_t i;

    for (i = 0; i < SCI_RX_SIZE + 10; i++)
        receive('x');
    PWMAB = 0x7F7F;
    receive_string("estop");
    TEST_ASSERT_EQUAL_HEX16(0, PWMAB);
    TEST_ASSERT_EQUAL(1, sci_take_stop_word());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_divider_is_the_nearest);
    RUN_TEST(characters_come_in_order_and_leave_work);
    RUN_TEST(all_that_is_written_goes_out_and_then_the_interrupt_rests);
    RUN_TEST(what_does_not_fit_is_cut);
    RUN_TEST(damaged_and_lost_characters_leave_a_mark_in_their_line);
    RUN_TEST(what_is_damaged_between_lines_marks_the_next_one_unless_the_line_rested);
    RUN_TEST(a_full_queue_marks_the_line_that_it_cuts);
    RUN_TEST(a_paste_of_64_kib_loses_nothing_though_nobody_reads);
    RUN_TEST(a_full_queue_stops_the_sender_in_time_and_lets_him_go_on);
    RUN_TEST(xoff_holds_our_answers_until_xon_or_anything_else);
    RUN_TEST(our_own_xoff_goes_out_though_we_are_held);
    RUN_TEST(a_new_rate_waits_until_all_is_sent);
    RUN_TEST(estop_turns_the_motors_off_wherever_it_stands);
    RUN_TEST(estop_works_though_the_queue_is_full);
    return UNITY_END();
}
