#include "drivers/usb.h"

#include "drivers/fx2_regs.h"

#define EVENTS (USBIRQ_SUDAV | USBIRQ_SUSP | USBIRQ_URES)

/* USB_EVENT_*: set by the interrupt, cleared by usb_take_events(). */
static volatile uint8_t pending;

usb_setup_t usb_setup;
XDATA AT(0xE740) uint8_t usb_control_data[USB_PACKET_EP0];

/* The answer that is on its way. */
static const XDATA uint8_t *answer;
static uint8_t answer_left;
static uint8_t answer_more; /* 1: at least one more packet, perhaps an empty one */
static uint8_t answer_ends_short;

ISR(usb_isr, INTERRUPT_USB)
{
    uint8_t causes = USBIRQ & EVENTS;

    /* The CPU's flag first, then the cause: a cause that comes in between sets the flag again. */
    EXIF &= (uint8_t)~EXIF_USBINT;
    USBIRQ = causes;
    EPIRQ = 0xFF;
    pending |= causes | USB_EVENT_ENDPOINT;
}

static const CODE register_value_t setup[] = {
    {XREG_ADDRESS(USBCS), USBCS_DISCON | USBCS_RENUM},
    {XREG_ADDRESS(EP1OUTCFG), EPCFG_INVALID},
    {XREG_ADDRESS(EP1INCFG), EPCFG_INVALID},
    {XREG_ADDRESS(EP2CFG), EPCFG_INVALID},
    {XREG_ADDRESS(EP4CFG), EPCFG_INVALID},
    {XREG_ADDRESS(EP8CFG), EPCFG_INVALID},
    {XREG_ADDRESS(INTSETUP), 0}, /* one handler for all causes: no autovectoring */
    {XREG_ADDRESS(USBIRQ), 0xFF},
    {XREG_ADDRESS(EPIRQ), 0xFF},
    {XREG_ADDRESS(USBIE), EVENTS},
    {XREG_ADDRESS(EPIE), EPIRQ_EP0IN | EPIRQ_EP0OUT | EPIRQ_EP2 | EPIRQ_EP6},
};

void usb_init(void)
{
    registers_set(setup, sizeof setup / sizeof setup[0]);
    EIE |= EIE_USB;
}

void usb_connect(void)
{
    USBCS = USBCS_RENUM;
}

uint8_t usb_is_high_speed(void)
{
    return USBCS & USBCS_HSM;
}

uint8_t usb_has_events(void)
{
    return pending;
}

uint8_t usb_take_events(void)
{
    uint8_t events;

    EA = 0;
    events = pending;
    pending = 0;
    EA = 1;
    return events;
}

#define SETUP_WORD(at) ((uint16_t)((uint16_t)SETUPDAT[(at) + 1] << 8) | SETUPDAT[at])

void usb_read_setup(void)
{
    usb_setup.type = SETUPDAT[0];
    usb_setup.number = SETUPDAT[1];
    usb_setup.value = SETUP_WORD(2);
    usb_setup.index = SETUP_WORD(4);
    usb_setup.length = SETUP_WORD(6);
    answer_more = 0;
}

/* A newer SETUP packet has come: what we would say now would answer the wrong request. */
static uint8_t superseded(void)
{
    return pending & USB_EVENT_SETUP;
}

static void load_packet(void)
{
    XDATA uint8_t *to = usb_control_data;
    uint8_t length = answer_left;
    uint8_t i;

    if (length > USB_PACKET_EP0)
        length = USB_PACKET_EP0;
    for (i = length; i != 0; i--)
        *to++ = *answer++;
    answer_left -= length;
    answer_more = answer_left;
    if (answer_left == 0 && length == USB_PACKET_EP0)
        answer_more = answer_ends_short;
    EP0BCH = 0;
    SYNCDELAY();
    EP0BCL = length;
}

void usb_control_send(const XDATA uint8_t *data, uint8_t length, uint8_t short_of_request)
{
    if (superseded())
        return;
    answer = data;
    answer_left = length;
    answer_ends_short = short_of_request;
    load_packet();
    EP0CS = EP0CS_HSNAK;
}

void usb_control_continue(void)
{
    if (answer_more && !superseded() && !(EP0CS & EP0CS_BUSY))
        load_packet();
}

void usb_control_receive(void)
{
    EP0BCL = 0; /* any write lets the host send */
}

uint8_t usb_control_received(void)
{
    if (superseded())
        return 0;
    return !(EP0CS & EP0CS_BUSY);
}

void usb_control_acknowledge(void)
{
    if (!superseded())
        EP0CS = EP0CS_HSNAK;
}

void usb_control_stall(void)
{
    if (!superseded())
        EP0CS = EP0CS_HSNAK | EP0CS_STALL;
}
