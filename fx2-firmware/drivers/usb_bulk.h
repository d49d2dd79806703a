/* The bulk endpoints 02 and 86, packet by packet under the CPU.
 *
 * Endpoint 6's buffers also take the samples that drivers/flash_stream.h throws away: nothing is
 * sent while that streams. Nothing here may be called from an interrupt. */
#ifndef DRIVERS_USB_BULK_H
#define DRIVERS_USB_BULK_H

#include "drivers/compiler.h"
#include "link/requests.h"

#include <stdint.h>

/* Bytes of a packet. */
#define USB_BULK_PACKET_FULL_SPEED 64u
#define USB_BULK_PACKET_HIGH_SPEED 512u

/* At the speed of the last usb_bulk_open(). */
extern uint16_t usb_bulk_packet;

/* The packet that waits at endpoint 02, and the one to be sent next by 86: the
 * chip's EP2FIFOBUF and EP6FIFOBUF. */
extern XDATA AT(0xF000) uint8_t usb_bulk_out_buffer[USB_BULK_PACKET_HIGH_SPEED];
extern XDATA AT(0xF800) uint8_t usb_bulk_in_buffer[USB_BULK_PACKET_HIGH_SPEED];

/* Both endpoints empty, not halted, data toggles 0; also when they are open already. 02 takes
 * nothing before usb_bulk_arm(). */
void usb_bulk_open(void);
void usb_bulk_close(void);

/* Forget what is in the buffers. */
void usb_bulk_reset(void);
/* The same, and let the host send to 02. */
void usb_bulk_arm(void);

/* Halt an endpoint, so that it answers STALL, or end its halt and start again with toggle 0.
 * `endpoint` is USB_BULK_OUT or USB_BULK_IN. */
void usb_bulk_halt(uint8_t endpoint, uint8_t halted);
uint8_t usb_bulk_is_halted(uint8_t endpoint);

/* Endpoint 02: 1 if a packet waits; its length; done with it. */
uint8_t usb_bulk_out_waits(void);
uint16_t usb_bulk_out_length(void);
void usb_bulk_out_next(void);

/* Endpoint 86: 1 if there is room for a packet; send usb_bulk_packet bytes. */
uint8_t usb_bulk_in_room(void);
void usb_bulk_in_send(void);

/* Sink and source: throw a packet away and send one of zeros, if there are. Returns 1 if so: call
 * again. This is what the Linux driver usbtest wants of a device. */
uint8_t usb_bulk_serve(void);

#endif
