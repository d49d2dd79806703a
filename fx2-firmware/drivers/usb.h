/* The FX2's USB engine: attachment, events and control transfers on endpoint 0.
 *
 * What to answer is decided above (app/usb_device.h); this moves it. The engine answers SET_ADDRESS
 * by itself. Nothing here may be called from an interrupt. */
#ifndef DRIVERS_USB_H
#define DRIVERS_USB_H

#include "drivers/compiler.h"

#include <stdint.h>

#define USB_PACKET_EP0 64u

/* A SETUP packet (USB 2.0, 9.3), its words in the CPU's byte order. */
typedef struct {
    uint8_t type;    /* bmRequestType */
    uint8_t number;  /* bRequest */
    uint16_t value;  /* wValue */
    uint16_t index;  /* wIndex */
    uint16_t length; /* wLength */
} usb_setup_t;

/* The request being handled: the last one that usb_read_setup() took. */
extern usb_setup_t usb_setup;

/* Events, as bits. */
#define USB_EVENT_SETUP    0x01u /* a SETUP packet waits: usb_read_setup() */
#define USB_EVENT_SUSPEND  0x08u /* nothing has moved on the bus for 3 ms: the cable, perhaps */
#define USB_EVENT_RESET    0x10u /* bus reset: the device is unconfigured */
#define USB_EVENT_ENDPOINT 0x80u /* an endpoint has sent or taken a packet */

/* Take requests in firmware, but stay off the bus. Endpoints 1, 2, 4 and 8 are disabled; 6 belongs
 * to drivers/flash_stream.h until usb_bulk_open(). */
void usb_init(void);

/* Not 0 at high speed, 0 at full speed. Settled when the first SETUP arrives. */
uint8_t usb_is_high_speed(void);

/* Connect the pull-up on D+: a host may find the device from now on. */
void usb_connect(void);

/* The events since the last call, as USB_EVENT_* bits; they are then forgotten. */
uint8_t usb_take_events(void);

/* 1 if usb_take_events() would return any. */
uint8_t usb_has_events(void);

/* Take the SETUP packet into usb_setup. It cancels an answer that is still on its way. */
void usb_read_setup(void);

/* The answer to a SETUP packet is exactly one of these three.
 *
 * Send `length` bytes (already cut to wLength) and acknowledge the status stage. `data` must stay
 * as it is until the next SETUP packet; on the FX2 it may lie in program memory, which MOVX reads
 * too. `short_of_request`: the host asked for more, so a last packet of full size is followed by an
 * empty one. */
void usb_control_send(const XDATA uint8_t *data, uint8_t length, uint8_t short_of_request);
/* Acknowledge a request without data. */
void usb_control_acknowledge(void);
/* Refuse the request. */
void usb_control_stall(void);

/* A request that brings data, up to one packet, is answered when they are there: let the host send
 * them, and once usb_control_received() returns 1 they are in usb_control_data
 * (the chip's EP0BUF). */
extern XDATA AT(0xE740) uint8_t usb_control_data[USB_PACKET_EP0];
void usb_control_receive(void);
uint8_t usb_control_received(void);

/* Load the next packet of an answer when there is room: to be called after each interrupt. */
void usb_control_continue(void);

/* Interrupt INT2: notes events. */
ISR(usb_isr, 8);

#endif
