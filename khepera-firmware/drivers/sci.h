/* The serial line: 8N1, interrupt-driven both ways. */
#ifndef DRIVERS_SCI_H
#define DRIVERS_SCI_H

#include <stdint.h>

/* Set the line up at `baud` (300..115200). Call after turret_init() (which sets the QSM's interrupt
 * levels), interrupts still masked. */
void sci_init(uint32_t baud);

/* Next character received, 0..255, or -1 if there is none. */
int sci_read(void);

/* Queue one character. Returns 1, or 0 if the queue is full (the character is not sent). Never
 * waits. */
int sci_write(uint8_t character);

/* Characters lost: framing errors, overruns, and the receive queue full. Saturates. */
uint16_t sci_losses(void);

#endif
