#include "host-tests/fx2-firmware/fakes/fake_usb.h"

#include "drivers/usb.h"

#include <assert.h>
#include <string.h>

usb_setup_t usb_setup;
fake_usb_answer_t fake_usb_answer;

static usb_setup_t waiting;
static uint8_t events;

void fake_usb_setup(uint8_t type, uint8_t number, uint16_t value, uint16_t index, uint16_t length)
{
    waiting.type = type;
    waiting.number = number;
    waiting.value = value;
    waiting.index = index;
    waiting.length = length;
    events |= USB_EVENT_SETUP;
    memset(&fake_usb_answer, 0, sizeof fake_usb_answer);
}

void fake_usb_bus_reset(void)
{
    events |= USB_EVENT_RESET;
}

int fake_usb_answers(void)
{
    return fake_usb_answer.sent + fake_usb_answer.acknowledged + fake_usb_answer.stalled;
}

uint8_t usb_take_events(void)
{
    uint8_t taken = events;

    events = 0;
    return taken;
}

uint8_t usb_has_events(void)
{
    return events;
}

void usb_read_setup(void)
{
    usb_setup = waiting;
}

void usb_control_send(const uint8_t *data, uint8_t length, uint8_t short_of_request)
{
    fake_usb_answer.sent++;
    memcpy(fake_usb_answer.data, data, length);
    fake_usb_answer.length = length;
    fake_usb_answer.short_of_request = short_of_request;
}

void usb_control_acknowledge(void)
{
    fake_usb_answer.acknowledged++;
}

void usb_control_stall(void)
{
    fake_usb_answer.stalled++;
}

void usb_control_continue(void) {}
