/* The turret's FX2: brings the FPGA up from the flash, with or without a PC, and answers on USB. */
#include "app/cameras.h"
#include "app/configure.h"
#include "app/descriptors.h"
#include "app/store.h"
#include "app/stream.h"
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

ONCE void init(void)
{
    clock_enable();
    usb_init();
    gpif_init();
    fpga_port_init();
    flash_bus_init();
    i2c_init();
    /* If only the FX2 was started anew, the FPGA may still drive the flash's data lines. */
    stream_close();
    cpu_allow_interrupts();
}

static void connect_when_due(void)
{
    if (!connected && clock_ticks() >= DISCONNECTED_TICKS) {
        connected = 1;
        usb_connect();
    }
}

ONCE void sleep_until_interrupt(void)
{
    cpu_hold_interrupts();
    if (usb_has_events())
        cpu_allow_interrupts();
    else
        cpu_sleep();
}

/* A design has come up, or none: what can only be done with the flash at rest. */
static void after_configuration(void)
{
    cameras_setup();
    store_note_marks();
}

void main(void)
{
    init();
    configure_from_flash(CONFIG_BOOT_DEFAULT);
    descriptors_init();
    for (;;) {
        uint8_t busy = usb_device_poll();

        busy |= store_step();
        if (configure_step()) {
            busy = 1;
            configuring = 1;
        } else if (configuring) {
            configuring = 0;
            after_configuration();
        }
        connect_when_due();
        if (!busy) {
            cameras_step();
            if (connected)
                sleep_until_interrupt();
        }
    }
}
