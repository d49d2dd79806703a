/* The host's side of USB control transfers, for tests on the PC: a SETUP packet goes in, what the
 * firmware answers comes out. */
#ifndef FAKES_FAKE_USB_H
#define FAKES_FAKE_USB_H

#include <stdint.h>

typedef struct {
    int sent;         /* usb_control_send() calls since the SETUP packet */
    int acknowledged; /* usb_control_acknowledge() calls */
    int stalled;      /* usb_control_stall() calls */
    uint8_t data[256];
    uint16_t length;
    int short_of_request;
} fake_usb_answer_t;

extern fake_usb_answer_t fake_usb_answer;
extern int fake_usb_high_speed;

/* The bulk endpoints: opened how often since they were last closed, and halted or not. */
extern int fake_usb_bulk_opened;
extern int fake_usb_bulk_halted_out;
extern int fake_usb_bulk_halted_in;

/* Put a SETUP packet, or a bus reset, before the firmware; the next poll finds it. */
void fake_usb_setup(uint8_t type, uint8_t number, uint16_t value, uint16_t index, uint16_t length);
void fake_usb_bus_reset(void);

/* The data of the request that was put before it last. */
void fake_usb_data(const uint8_t *data, uint16_t length);
void fake_usb_suspend(void);

/* The bulk endpoints' packets, with alternate setting 2: what the host has sent, so many
 * bytes still to be taken, and what it has got. */
extern const uint8_t *fake_usb_out;
extern uint32_t fake_usb_out_left;
extern int fake_usb_out_armed;
extern uint8_t fake_usb_in[65536];
extern uint32_t fake_usb_in_count;
extern int fake_usb_in_full; /* the host does not fetch anything */

/* Answers of any kind to the last SETUP packet: should be one. */
int fake_usb_answers(void);

#endif
