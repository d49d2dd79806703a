#include "drivers/usb_bulk.h"

#include "drivers/fx2_regs.h"
#include "drivers/usb.h"

#define BUFFERS 4u

uint16_t usb_bulk_packet;
XDATA AT(0xF000) uint8_t usb_bulk_out_buffer[USB_BULK_PACKET_HIGH_SPEED];
XDATA AT(0xF800) uint8_t usb_bulk_in_buffer[USB_BULK_PACKET_HIGH_SPEED];

/* Both empty, and the host held off until end_reset(). */
static void begin_reset(void)
{
    FIFORESET = FIFORESET_NAKALL;
    SYNCDELAY();
    FIFORESET = FIFORESET_NAKALL | 2;
    SYNCDELAY();
    FIFORESET = FIFORESET_NAKALL | 6;
    SYNCDELAY();
}

static void end_reset(void)
{
    FIFORESET = 0;
    SYNCDELAY();
}

void usb_bulk_reset(void)
{
    begin_reset();
    end_reset();
}

/* Hand the buffer to the host for its next packet, whatever was in it. */
void usb_bulk_out_next(void)
{
    EP2BCL = EPBCL_SKIP;
    SYNCDELAY();
}

void usb_bulk_arm(void)
{
    uint8_t buffers = BUFFERS;

    begin_reset();
    do {
        usb_bulk_out_next();
    } while (--buffers);
    end_reset(); /* not before: the next one would throw away a packet that came in between */
}

void usb_bulk_open(void)
{
    usb_bulk_packet = usb_is_high_speed() ? USB_BULK_PACKET_HIGH_SPEED : USB_BULK_PACKET_FULL_SPEED;
    EP2CFG = EPCFG_VALID | EPCFG_BULK | EPCFG_QUAD;
    usb_bulk_reset();
    usb_bulk_halt(USB_BULK_OUT, 0);
    usb_bulk_halt(USB_BULK_IN, 0);
}

void usb_bulk_close(void)
{
    EP2CFG = EPCFG_INVALID;
    usb_bulk_reset();
}

/* The register is written once to choose the endpoint and once more to change it (TRM 15.8). */
static void reset_toggle(uint8_t choice)
{
    TOGCTL = choice;
    TOGCTL = choice | TOGCTL_RESET;
}

void usb_bulk_halt(uint8_t endpoint, uint8_t halted)
{
    uint8_t control = halted ? EPCS_STALL : 0;

    if (endpoint == USB_BULK_OUT) {
        EP2CS = control;
        if (!halted)
            reset_toggle(2);
    } else {
        EP6CS = control;
        if (!halted)
            reset_toggle(TOGCTL_IN | 6);
    }
}

uint8_t usb_bulk_is_halted(uint8_t endpoint)
{
    return (endpoint == USB_BULK_OUT ? EP2CS : EP6CS) & EPCS_STALL;
}

uint8_t usb_bulk_out_waits(void)
{
    return !(EP2468STAT & EP2468STAT_EP2_EMPTY);
}

uint16_t usb_bulk_out_length(void)
{
    return (uint16_t)((uint16_t)EP2BCH << 8) | EP2BCL;
}

uint8_t usb_bulk_in_room(void)
{
    return !(EP2468STAT & EP2468STAT_EP6_FULL);
}

void usb_bulk_in_send(void)
{
    EP6BCH = (uint8_t)(usb_bulk_packet >> 8);
    SYNCDELAY();
    EP6BCL = (uint8_t)usb_bulk_packet;
    SYNCDELAY();
}

uint8_t usb_bulk_serve(void)
{
    uint8_t served = 0;

    if (usb_bulk_out_waits()) {
        usb_bulk_out_next();
        served = 1;
    }
    if (usb_bulk_in_room()) {
        XDATA uint8_t *to = usb_bulk_in_buffer;
        uint16_t left;

        for (left = usb_bulk_packet; left != 0; left--)
            *to++ = 0;
        usb_bulk_in_send();
        served = 1;
    }
    return served;
}
