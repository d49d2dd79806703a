/* Configuring the FPGA: from the flash, or with what comes over USB.
 *
 * A job: one of the first two functions begins it, then configure_step() is called as often as the
 * CPU has time, until it returns 0. A step takes some microseconds (finding a slot: a few
 * milliseconds), so that USB is served in between; the bytes themselves get into the FPGA without
 * the CPU. Whatever goes wrong, it ends within seconds, with a reason in configure_status(): with
 * the golden slot's design if there is one, or else with an erased FPGA. */
#ifndef APP_CONFIGURE_H
#define APP_CONFIGURE_H

#include "drivers/compiler.h"
#include "link/requests.h"

#include <stdint.h>

/* Begin to configure the FPGA from slot `slot` (0..31), or from the default slot
 * (CONFIG_BOOT_DEFAULT). No job is under way. */
void configure_from_flash(uint8_t slot);

/* Begin to configure the FPGA with the bytes that come to endpoint 02 from now on. `kind` is
 * CONFIG_BEGIN_*; the header in flash_page tells length and part. Returns 1, or 0 and changes
 * nothing if the header does not fit the board, or there is no running design to change in part. No
 * job is under way. */
uint8_t configure_from_usb(uint8_t kind);

/* End a job that takes bytes from USB; one from the flash takes its course. */
void configure_abort(void);

/* Go on. Returns 1 while there is more to do. */
uint8_t configure_step(void);

/* 1 while there is more to do. */
uint8_t configure_busy(void);

/* How it stands, with the pins' levels of this moment: the answer to REQUEST_CONFIG_STATUS. Valid
 * until the next call of any of these. */
const XDATA uint8_t *configure_status(void);

#endif
