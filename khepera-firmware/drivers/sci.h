/* The serial line: 8N1, interrupt-driven both ways.
 *
 * Flow control is XON/XOFF (DC1/DC3), which needs no wires. The receive queue holds 128 KiB: a
 * paste of 64 KiB fits even if the sender knows no flow control and every line of it is answered.
 * XOFF goes out when the queue is three quarters full, XON when it is down to a quarter. An XOFF
 * that comes in holds our answers back until XON or any other character comes: one that line noise
 * made costs nothing but time.
 *
 * A character that comes damaged (framing error, a break, noise) or is lost (overrun, queue full)
 * leaves SCI_DAMAGED in its place, so that nobody takes what is left of a line for another line.
 * Only what is wrong between two lines, with the line at rest behind it, leaves nothing.
 *
 * The word `estop` turns the motors off in the receive interrupt itself, wherever it stands in the
 * stream and however much waits before it. */
#ifndef DRIVERS_SCI_H
#define DRIVERS_SCI_H

#include <stdint.h>

#define SCI_RX_SIZE 0x20000u /* powers of two */
#define SCI_TX_SIZE 0x8000u
#define SCI_XON     0x11u
#define SCI_XOFF    0x13u
#define SCI_DAMAGED 0x1Au /* ASCII SUB */

/* Set the line up at `baud` (300..115200). Call after qspi_init() (which sets the QSM's interrupt
 * levels), interrupts still masked. */
void sci_init(uint32_t baud);

/* 1 if sci_read() would give something. */
int sci_waits(void);

/* Next character received, 0..255, SCI_DAMAGED for one or more that are missing; -1 if there is
 * none.
 */
int sci_read(void);

/* Queue characters; those that the queue does not take are lost (see sci_room()). Never waits. */
void sci_write(const char *characters, uint16_t count);

/* Characters that the transmit queue still takes. */
uint32_t sci_room(void);

/* 1 if everything queued has left the chip, its stop bit included. */
int sci_sent(void);

/* Change the baud rate as soon as everything queued has been sent. */
void sci_set_baud(uint32_t baud);

/* Once a tick: takes a new baud rate up. */
void sci_poll(void);

/* 1 once after each `estop`. */
int sci_take_stop_word(void);

/* Characters lost: framing errors, noise, overruns, and the receive queue full. Saturates. */
uint16_t sci_losses(void);

#endif
