/* Jobs on the bitstream store: read, write, erase, mark.
 *
 * store_begin() begins a job, then store_step() is called as often as the CPU has time, until it
 * returns 0. A step takes at most some milliseconds. What a power cut leaves behind is the old
 * bitstream, nothing, or the new one: a write goes to the bank that does not count, whose commit
 * word is destroyed first and programmed last; marks that lie in the bank to be erased are appended
 * to the other one before. */
#ifndef APP_STORE_H
#define APP_STORE_H

#include "drivers/compiler.h"
#include "link/requests.h"

#include <stdint.h>

/* Begin the job that the request in usb_setup (drivers/usb.h) asks for, one of REQUEST_STORE_*; a
 * write's header lies in flash_page and in slot_store_header. Returns 1, or 0 and begins nothing if
 * value, index or header are not as link/requests.h wants them. No other job is under way. */
uint8_t store_begin(void);

/* End a read or a write; others take their course. */
void store_abort(void);

/* Go on. Returns 1 while there is more to do. */
uint8_t store_step(void);

/* 1 while there is more to do. */
uint8_t store_busy(void);

/* Look for the marks, for the status; a job that changes them does so at its end. The flash is
 * ready and nobody else uses it. */
void store_note_marks(void);

/* The answer to REQUEST_STORE_STATUS. Valid until the next call of any of these. */
const XDATA uint8_t *store_status(void);

#endif
