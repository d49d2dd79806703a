/* The two bulk endpoints as sink and source: what the host sends is thrown away, what it reads is
 * zeros. This is what the Linux driver usbtest wants of a device.
 *
 * The source shares its buffers with drivers/flash_stream.h: open only while nothing is streamed.
 * Nothing here may be called from an interrupt. */
#ifndef DRIVERS_USB_BULK_H
#define DRIVERS_USB_BULK_H

#include "link/requests.h"

#include <stdint.h>

/* Bytes of a packet. */
#define USB_BULK_PACKET_FULL_SPEED 64u
#define USB_BULK_PACKET_HIGH_SPEED 512u

/* Both endpoints empty, not halted, data toggles 0; also when they are open already. */
void usb_bulk_open(void);
void usb_bulk_close(void);

/* Halt an endpoint, so that it answers STALL, or end its halt and start again with toggle 0.
 * `endpoint` is one of the two above. */
void usb_bulk_halt(uint8_t endpoint, uint8_t halted);
uint8_t usb_bulk_is_halted(uint8_t endpoint);

/* Throw a packet away and fill one, if there are. Returns 1 if so: call again. */
uint8_t usb_bulk_serve(void);

#endif
