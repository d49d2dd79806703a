#include "drivers/sci.h"

#include "board/khepera.h"
#include "board/mc68331.h"
#include "drivers/interrupts.h"

/* Queues: powers of two; head and tail run freely, head - tail is what is in it.
 *
 *   tail ... head-1   waiting        written by one side only each: the receive queue's head and
 *                                    the transmit queue's tail by the interrupt, the others by the
 *                                    program.
 */
#define RX_SIZE 256u
#define TX_SIZE 1024u

static struct {
    volatile uint16_t head;
    volatile uint16_t tail;
    uint8_t data[RX_SIZE];
} rx;
static struct {
    volatile uint16_t head;
    volatile uint16_t tail;
    uint8_t data[TX_SIZE];
} tx;
static volatile uint16_t losses;

static void count_loss(void)
{
    if (losses < UINT16_MAX)
        losses++;
}

static void receive(uint16_t status)
{
    uint8_t character = (uint8_t)SCDR; /* the read clears the flags that SCSR's read showed */

    if (status & (SCSR_OR | SCSR_FE))
        count_loss();
    if (status & SCSR_FE)
        return;
    if ((uint16_t)(rx.head - rx.tail) == RX_SIZE) {
        count_loss();
        return;
    }
    rx.data[rx.head % RX_SIZE] = character;
    rx.head++;
    interrupts_work = 1;
}

void sci_isr(void) __attribute__((interrupt_handler));
void sci_isr(void)
{
    uint16_t status = SCSR;

    if (status & SCSR_RDRF)
        receive(status);
    if (!(status & SCSR_TDRE) || !(SCCR1 & SCCR1_TIE))
        return;
    if (tx.head == tx.tail) {
        SCCR1 &= (uint16_t)~SCCR1_TIE;
    } else {
        SCDR = tx.data[tx.tail % TX_SIZE];
        tx.tail++;
    }
}

void sci_init(uint32_t baud)
{
    SCCR0 = (uint16_t)((BOARD_SYSTEM_HZ + 16 * baud) / (32 * baud));
    SCCR1 = SCCR1_TE | SCCR1_RE | SCCR1_RIE;
}

int sci_read(void)
{
    uint8_t character;

    if (rx.head == rx.tail)
        return -1;
    character = rx.data[rx.tail % RX_SIZE];
    rx.tail++;
    return character;
}

int sci_write(uint8_t character)
{
    uint16_t status;

    if ((uint16_t)(tx.head - tx.tail) == TX_SIZE)
        return 0;
    tx.data[tx.head % TX_SIZE] = character;
    tx.head++;
    /* Read-modify-write of a register that the interrupt changes too. */
    status = interrupts_mask();
    SCCR1 |= SCCR1_TIE;
    interrupts_restore(status);
    return 1;
}

uint16_t sci_losses(void)
{
    return losses;
}
