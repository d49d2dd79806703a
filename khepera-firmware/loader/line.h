/* The loader's serial line, clock and watchdog: polled, without interrupts. */
#ifndef LOADER_LINE_H
#define LOADER_LINE_H

#include <stdint.h>

/* 8N1 at `baud`; waits for what is still being sent. */
void line_open(uint32_t baud);
/* Lets go of it, once all is sent: as after a reset. */
void line_close(void);

/* Next character, or -1. */
int line_read(void);
/* Send, waiting for each character's turn. Serves the watchdog. */
void line_write(const uint8_t *bytes, uint16_t size);

/* Once, then keep calling line_breathe() at least every 60 ms: it serves the watchdog and keeps the
 * clock, which counts ms from clock_start() on. */
void clock_start(void);
void line_breathe(void);
uint32_t clock_ms(void);

#endif
