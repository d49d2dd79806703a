#include "drivers/sci.h"

#include "board/khepera.h"
#include "board/mc68331.h"
#include "drivers/interrupts.h"
#include "drivers/motors.h"
#include "drivers/stop_word.h"

#define RX_STOP  (SCI_RX_SIZE * 3u / 4u)
#define RX_GO_ON (SCI_RX_SIZE / 4u)

/* Queues: head and tail run freely, head - tail is what is in it.
 *
 *   tail ... head-1   waiting        written by one side only each: the receive queue's head and
 *                                    the transmit queue's tail by the interrupt, the others by the
 *                                    program. Their 32 bits are read and written in one
 *                                    instruction.
 */
static struct {
    volatile uint32_t head;
    volatile uint32_t tail;
} rx;
static struct {
    volatile uint32_t head;
    volatile uint32_t tail;
} tx;
UNCLEARED static uint8_t rx_data[SCI_RX_SIZE];
UNCLEARED static uint8_t tx_data[SCI_TX_SIZE];

/* Shared by interrupt and program; the program changes them with interrupts masked. */
static volatile uint16_t losses;
static volatile uint8_t stop_words; /* not yet taken */
static volatile uint8_t urgent;     /* XON or XOFF, to be sent before the queue; 0 = none */
static volatile uint8_t sender_held;
static volatile uint8_t we_are_held;
/* Interrupt only. */
static uint8_t stop_word_matched;
static uint8_t in_line; /* characters of a line have come, its end has not */
static enum { DAMAGE_NONE, DAMAGE_BEFORE_LINE, DAMAGE_IN_LINE } damage; /* not yet in the queue */
static uint32_t next_baud; /* program only; 0 = no change */

static void count_loss(void)
{
    if (losses < UINT16_MAX)
        losses++;
}

static void request_transmit(void)
{
    SCCR1 |= SCCR1_TIE;
}

static void count_damage(void)
{
    count_loss();
    if (damage == DAMAGE_NONE)
        damage = in_line ? DAMAGE_IN_LINE : DAMAGE_BEFORE_LINE;
}

/* Returns 0 if the queue is full. */
static int enqueue(uint8_t character)
{
    if (rx.head - rx.tail == SCI_RX_SIZE)
        return 0;
    rx_data[rx.head % SCI_RX_SIZE] = character;
    rx.head++;
    return 1;
}

/* A character that counts. */
static void take_in(uint8_t character)
{
    if (damage != DAMAGE_NONE && enqueue(SCI_DAMAGED))
        damage = DAMAGE_NONE;
    if (!enqueue(character))
        count_damage();
    in_line = character != '\r' && character != '\n';
    if (rx.head - rx.tail >= RX_STOP && !sender_held) {
        sender_held = 1;
        urgent = SCI_XOFF;
        request_transmit();
    }
    interrupts_work = 1;
}

static void take_character(uint8_t character)
{
    if (stop_word_take(&stop_word_matched, character)) {
        motors_drive(0, 0);
        if (stop_words < UINT8_MAX)
            stop_words++;
        interrupts_work = 1;
    }
    if (character == SCI_XOFF) {
        we_are_held = 1;
        return;
    }
    if (we_are_held) {
        we_are_held = 0;
        request_transmit();
    }
    if (character != SCI_XON)
        take_in(character);
}

static void receive(uint16_t status)
{
    uint8_t character = (uint8_t)SCDR; /* the read clears the flags that SCSR's read showed */

    /* The line has been at rest since what was damaged: that was no part of a command. */
    if (damage == DAMAGE_BEFORE_LINE && (status & SCSR_IDLE))
        damage = DAMAGE_NONE;
    if (status & (SCSR_FE | SCSR_NF)) {
        count_damage();
        return;
    }
    take_character(character);
    if (status & SCSR_OR)
        count_damage(); /* the one after it */
}

static void transmit(void)
{
    if (urgent) {
        SCDR = urgent;
        urgent = 0;
    } else if (tx.head == tx.tail || we_are_held) {
        SCCR1 &= (uint16_t)~SCCR1_TIE;
    } else {
        SCDR = tx_data[tx.tail % SCI_TX_SIZE];
        tx.tail++;
        /* Lines wait for room in the queue: tell the program when there is some again. */
        if (tx.tail % (SCI_TX_SIZE / 16u) == 0 || tx.head == tx.tail)
            interrupts_work = 1;
    }
}

INTERRUPT void sci_isr(void);
INTERRUPT void sci_isr(void)
{
    uint16_t status = SCSR;

    if (status & SCSR_RDRF)
        receive(status);
    if ((status & SCSR_TDRE) && (SCCR1 & SCCR1_TIE))
        transmit();
}

static uint16_t divider(uint32_t baud)
{
    return (uint16_t)((BOARD_SYSTEM_HZ + 16 * baud) / (32 * baud));
}

void sci_init(uint32_t baud)
{
    SCCR0 = divider(baud);
    SCCR1 = SCCR1_TE | SCCR1_RE | SCCR1_RIE;
}

/* Read-modify-write of a register that the interrupt changes too. */
static void start_transmitter(void)
{
    uint16_t status = access_mask();

    request_transmit();
    access_restore(status);
}

int sci_waits(void)
{
    return rx.head != rx.tail;
}

int sci_read(void)
{
    uint8_t character;

    if (rx.head == rx.tail)
        return -1;
    character = rx_data[rx.tail % SCI_RX_SIZE];
    rx.tail++;
    if (sender_held && rx.head - rx.tail <= RX_GO_ON) {
        uint16_t status = access_mask();

        sender_held = 0;
        urgent = SCI_XON;
        request_transmit();
        access_restore(status);
    }
    return character;
}

void sci_write(const char *characters, uint16_t count)
{
    uint32_t head = tx.head;
    uint32_t room = sci_room();

    if (count > room)
        count = (uint16_t)room;
    for (; count > 0; count--)
        tx_data[head++ % SCI_TX_SIZE] = (uint8_t)*characters++;
    tx.head = head;
    if (!(SCCR1 & SCCR1_TIE) && !we_are_held)
        start_transmitter();
}

uint32_t sci_room(void)
{
    return SCI_TX_SIZE - (tx.head - tx.tail);
}

int sci_sent(void)
{
    return tx.head == tx.tail && (SCSR & SCSR_TC) != 0;
}

void sci_set_baud(uint32_t baud)
{
    next_baud = baud;
}

void sci_poll(void)
{
    if (next_baud == 0 || !sci_sent())
        return;
    SCCR0 = divider(next_baud);
    next_baud = 0;
}

int sci_take_stop_word(void)
{
    uint16_t status;
    uint8_t words;

    if (stop_words == 0)
        return 0;
    status = access_mask();
    words = stop_words;
    stop_words = 0;
    access_restore(status);
    return words > 0;
}

uint16_t sci_losses(void)
{
    return losses;
}
