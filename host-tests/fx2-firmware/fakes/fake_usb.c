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

const uint8_t *fake_usb_out;
uint32_t fake_usb_out_left;
int fake_usb_out_armed;
uint8_t fake_usb_in[65536];
uint32_t fake_usb_in_count;
int fake_usb_in_full;

uint16_t usb_bulk_packet = 512;
uint8_t usb_bulk_out_buffer[USB_BULK_PACKET_HIGH_SPEED];
uint8_t usb_bulk_in_buffer[USB_BULK_PACKET_HIGH_SPEED];
uint8_t usb_control_data[USB_PACKET_EP0];

static int receiving; /* data of a request are awaited */
static int received;
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
    receiving = 0;
    received = 0;
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

void fake_usb_suspend(void)
{
    events |= USB_EVENT_SUSPEND;
}

void fake_usb_data(const uint8_t *data, uint16_t length)
{
    assert(receiving && length <= sizeof usb_control_data);
    memcpy(usb_control_data, data, length);
    receiving = 0;
    received = 1;
}

void usb_control_receive(void)
{
    receiving = 1;
}

uint8_t usb_control_received(void)
{
    uint8_t now = (uint8_t)received;

    received = 0;
    return now;
}

void usb_bulk_open(void)
{
    fake_usb_bulk_opened++;
    fake_usb_bulk_halted_out = 0;
    fake_usb_bulk_halted_in = 0;
    fake_usb_out_armed = 0;
    usb_bulk_packet = fake_usb_high_speed ? 512 : 64;
}

void usb_bulk_close(void)
{
    fake_usb_bulk_opened = 0;
    fake_usb_out_armed = 0;
}

void usb_bulk_reset(void)
{
    fake_usb_in_count = 0;
    fake_usb_out_armed = 0;
}

void usb_bulk_arm(void)
{
    fake_usb_out_armed = 1;
}

void usb_bulk_halt(uint8_t endpoint, uint8_t halted)
{
    assert(endpoint == USB_BULK_OUT || endpoint == USB_BULK_IN);
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

uint16_t usb_bulk_out_length(void)
{
    return fake_usb_out_left < usb_bulk_packet ? (uint16_t)fake_usb_out_left : usb_bulk_packet;
}

uint8_t usb_bulk_out_waits(void)
{
    if (!fake_usb_out_armed || fake_usb_out_left == 0)
        return 0;
    memcpy(usb_bulk_out_buffer, fake_usb_out, usb_bulk_out_length());
    return 1;
}

void usb_bulk_out_next(void)
{
    uint16_t length = usb_bulk_out_length();

    fake_usb_out += length;
    fake_usb_out_left -= length;
}

uint8_t usb_bulk_in_room(void)
{
    return !fake_usb_in_full && fake_usb_in_count + usb_bulk_packet <= sizeof fake_usb_in;
}

void usb_bulk_in_send(void)
{
    memcpy(fake_usb_in + fake_usb_in_count, usb_bulk_in_buffer, usb_bulk_packet);
    fake_usb_in_count += usb_bulk_packet;
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
