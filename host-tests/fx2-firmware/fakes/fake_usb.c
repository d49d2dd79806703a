#include "host-tests/fx2-firmware/fakes/fake_usb.h"

#include "drivers/usb.h"
#include "drivers/usb_bulk.h"

#include <assert.h>
#include <string.h>

usb_setup_t usb_setup;
fake_usb_answer_t fake_usb_answer;
int fake_usb_high_speed;
int fake_usb_bulk_opened;
int fake_usb_bulk_halted_out;
int fake_usb_bulk_halted_in;

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

uint8_t usb_is_high_speed(void)
{
    return (uint8_t)fake_usb_high_speed;
}

void usb_bulk_open(void)
{
    fake_usb_bulk_opened++;
    fake_usb_bulk_halted_out = 0;
    fake_usb_bulk_halted_in = 0;
}

void usb_bulk_close(void)
{
    fake_usb_bulk_opened = 0;
}

void usb_bulk_halt(uint8_t endpoint, uint8_t halted)
{
    assert(fake_usb_bulk_opened && (endpoint == USB_BULK_OUT || endpoint == USB_BULK_IN));
    if (endpoint == USB_BULK_OUT)
        fake_usb_bulk_halted_out = halted;
    else
        fake_usb_bulk_halted_in = halted;
}

uint8_t usb_bulk_is_halted(uint8_t endpoint)
{
    assert(fake_usb_bulk_opened && (endpoint == USB_BULK_OUT || endpoint == USB_BULK_IN));
    return (uint8_t)(endpoint == USB_BULK_OUT ? fake_usb_bulk_halted_out : fake_usb_bulk_halted_in);
}

uint8_t usb_bulk_serve(void)
{
    assert(fake_usb_bulk_opened);
    return 0;
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
