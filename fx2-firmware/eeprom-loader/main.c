/* The EEPROM loader's FX2: takes over requests on a connection that stays as it is. */
#include "drivers/clock.h"
#include "drivers/cpu.h"
#include "drivers/fx2_regs.h"
#include "drivers/i2c.h"
#include "drivers/usb.h"
#include "eeprom-loader/loader.h"

static const CODE register_value_t setup[] = {
    {XREG_ADDRESS(INTSETUP), 0}, /* no autovectoring */
    {XREG_ADDRESS(USBIRQ), 0xFF},
    {XREG_ADDRESS(EPIRQ), 0xFF},
    {XREG_ADDRESS(USBIE), USBIRQ_SUDAV | USBIRQ_URES},
    {XREG_ADDRESS(EPIE), EPIRQ_EP0IN | EPIRQ_EP0OUT},
    {XREG_ADDRESS(USBCS), USBCS_RENUM},
};

void main(void)
{
    clock_enable();
    i2c_init();
    registers_set(setup, sizeof setup / sizeof setup[0]);
    EIE |= EIE_USB;
    cpu_allow_interrupts();
    for (;;) {
        if (loader_poll())
            USBCS = 0; /* the chip's own logic enumerates as a blank one */
    }
}
