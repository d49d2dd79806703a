/* The turret as a USB device: standard requests (USB 2.0 chapter 9) and those of link/requests.h.
 *
 * Every request is answered exactly once; an unknown or ill-formed one is refused with STALL and
 * changes nothing. */
#ifndef APP_USB_DEVICE_H
#define APP_USB_DEVICE_H

#include <stdint.h>

/* Serve what has happened on USB since the last call. To be called after each interrupt, and again
 * while it returns 1. */
uint8_t usb_device_poll(void);

#endif
