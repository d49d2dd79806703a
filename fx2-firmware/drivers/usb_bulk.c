#include "drivers/usb_bulk.h"

#include "drivers/fx2_regs.h"
#include "drivers/usb.h"

static uint16_t packet_size;

static void reset_fifos(void)
{
    FIFORESET = FIFORESET_NAKALL;
    SYNCDELAY();
    FIFORESET = FIFORESET_NAKALL | 2;
    SYNCDELAY();
    FIFORESET = FIFORESET_NAKALL | 6;
    SYNCDELAY();
    FIFORESET = 0;
    SYNCDELAY();
}

/* Hand a buffer to the host for its next packet, whatever was in it. */
static void arm_out(void)
{
    EP2BCL = EPBCL_SKIP;
    SYNCDELAY();
}

void usb_bulk_open(void)
{
    packet_size = usb_is_high_speed() ? USB_BULK_PACKET_HIGH_SPEED : USB_BULK_PACKET_FULL_SPEED;
    EP2CFG = EPCFG_VALID | EPCFG_BULK | EPCFG_DOUBLE;
    reset_fifos();
    usb_bulk_halt(USB_BULK_OUT, 0);
    usb_bulk_halt(USB_BULK_IN, 0);
    arm_out();
    arm_out();
}

void usb_bulk_close(void)
{
    EP2CFG = EPCFG_INVALID;
    reset_fifos();
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

static void send_zeros(void)
{
    volatile XDATA uint8_t *to = EP6FIFOBUF;
    uint16_t left;

    for (left = packet_size; left != 0; left--)
        *to++ = 0;
    EP6BCH = (uint8_t)(packet_size >> 8);
    SYNCDELAY();
    EP6BCL = (uint8_t)packet_size;
    SYNCDELAY();
}

uint8_t usb_bulk_serve(void)
{
    uint8_t served = 0;

    if (!(EP2468STAT & EP2468STAT_EP2_EMPTY)) {
        arm_out();
        served = 1;
    }
    if (!(EP2468STAT & EP2468STAT_EP6_FULL)) {
        send_zeros();
        served = 1;
    }
    return served;
}
