/* The turret's FX2: brings the FPGA up from the flash, with or without a PC, and answers on USB. */
#include "app/cameras.h"
#include "app/configure.h"
#include "app/usb_device.h"
#include "drivers/clock.h"
#include "drivers/cpu.h"
#include "drivers/flash_bus.h"
#include "drivers/fpga_port.h"
#include "drivers/gpif.h"
#include "drivers/i2c.h"
#include "drivers/usb.h"

/* If the image came over USB (request 0xA0), the host still believes in the blank chip: stay off
 * the bus long enough for any hub to notice. */
#define DISCONNECTED_TICKS CLOCK_TICKS(20000ul)

static uint8_t connected;
static uint8_t configuring; /* a design may come up that wants its cameras set up */

static void init(void)
{
    clock_enable();
    usb_init();
    gpif_init();
    fpga_port_init();
    flash_bus_init();
    i2c_init();
    cpu_allow_interrupts();
}

static void connect_when_due(void)
{
    if (!connected && clock_ticks() >= DISCONNECTED_TICKS) {
        connected = 1;
        usb_connect();
    }
}

static void sleep_until_interrupt(void)
{
    cpu_hold_interrupts();
    if (usb_has_events())
        cpu_allow_interrupts();
    else
        cpu_sleep();
}

void main(void)
{
    init();
    configure_start();
    for (;;) {
        uint8_t busy = usb_device_poll();

        if (configure_step()) {
            busy = 1;
            configuring = 1;
        } else if (configuring) {
            configuring = 0;
            cameras_setup();
        }
        connect_when_due();
        if (!busy) {
            cameras_step();
            if (connected)
                sleep_until_interrupt();
        }
    }
}
