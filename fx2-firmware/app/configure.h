/* Configuring the FPGA from the flash.
 *
 * A state machine: configure_start(), then configure_step() as often as the CPU has time, until it
 * returns 0. A step takes some microseconds (finding the slot: a few milliseconds), so that USB is
 * served in between; the bytes themselves go from flash to FPGA without the CPU. Whatever goes
 * wrong, it ends within seconds, with a reason in configure_status(). */
#ifndef APP_CONFIGURE_H
#define APP_CONFIGURE_H

#include "drivers/compiler.h"
#include "link/requests.h"

#include <stdint.h>

/* Begin to configure the FPGA from the default slot. One that is under way is abandoned. */
void configure_start(void);

/* Go on. Returns 1 while there is more to do. */
uint8_t configure_step(void);

/* 1 while there is more to do. */
uint8_t configure_busy(void);

/* How it stands, with the pins' levels of this moment: the answer to REQUEST_CONFIG_STATUS. Valid
 * until the next call of any of these. */
const XDATA uint8_t *configure_status(void);

#endif
