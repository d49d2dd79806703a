#include "drivers/usb_stream.h"

#include "drivers/fx2_regs.h"
#include "drivers/usb_bulk.h"

#define COUNT_BYTES 4u

/* The endpoint's packets go to the GPIF by themselves while AUTOOUT is set; its rising edge hands
 * all buffers to the host. */
void usb_stream_begin(const XDATA uint8_t length[4])
{
    volatile XDATA uint8_t *count = &GPIFTCB3; /* and the other three behind it */
    uint8_t left = COUNT_BYTES;

    usb_bulk_reset();
    EP2FIFOCFG = FIFOCFG_AUTOOUT;
    do {
        SYNCDELAY();
        *count++ = *length++;
    } while (--left);
    SYNCDELAY();
    GPIFTRIG = GPIFTRIG_EP2;
}

uint16_t usb_stream_left_256(void)
{
    uint8_t upper;
    uint8_t lower;

    do {
        upper = GPIFTCB2;
        lower = GPIFTCB1;
    } while (upper != GPIFTCB2);
    return (uint16_t)((uint16_t)upper << 8) | lower;
}

uint8_t usb_stream_done(void)
{
    return GPIFTRIG & GPIFTRIG_DONE;
}

uint8_t usb_stream_surplus(void)
{
    return !(EP24FIFOFLGS & EP24FIFOFLGS_EP2_EMPTY);
}

void usb_stream_end(void)
{
    GPIFABORT = 0xFF;
    EP2FIFOCFG = 0;
    SYNCDELAY();
    usb_bulk_reset();
}
