#include "drivers/slave_fifo.h"

#include "drivers/fx2_regs.h"
#include "drivers/usb_bulk.h"

/* The slave FIFO's flag comes 9.5 ns after IFCLK and SLWR wants 10.4 ns before it (data sheet of
 * the CY7C68013, slave FIFO synchronous): at 48 MHz 1 ns would be left, at 30 MHz 13 ns. 60 MB/s
 * are more than USB carries. */
static const CODE register_value_t open_table[] = {
    {XREG_ADDRESS(IFCONFIG), IFCONFIG_INTERNAL | IFCONFIG_OUTPUT | IFCONFIG_SLAVE},
    {XREG_ADDRESS(EP6FIFOCFG), FIFOCFG_AUTOIN | FIFOCFG_WORDWIDE},
    {XREG_ADDRESS(EPIE),
     EPIRQ_EP0IN | EPIRQ_EP0OUT}, /* packets that are sent shall not wake the CPU */
};

static const CODE register_value_t close_table[] = {
    {XREG_ADDRESS(EPIE), EPIRQ_EP0IN | EPIRQ_EP0OUT | EPIRQ_EP2 | EPIRQ_EP6},
    {XREG_ADDRESS(EP6FIFOCFG), 0},
    {XREG_ADDRESS(IFCONFIG), IFCONFIG_INTERNAL | IFCONFIG_48MHZ | IFCONFIG_OUTPUT | IFCONFIG_GPIF},
};

#define COUNT(table) (sizeof(table) / sizeof((table)[0]))

void slave_fifo_open(void)
{
    EP6AUTOINLENH = (uint8_t)(usb_bulk_packet >> 8);
    SYNCDELAY();
    EP6AUTOINLENL = (uint8_t)usb_bulk_packet;
    SYNCDELAY();
    registers_set(open_table, COUNT(open_table));
}

void slave_fifo_close(void)
{
    registers_set(close_table, COUNT(close_table));
}
