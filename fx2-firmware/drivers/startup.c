#include "drivers/clock.h"

/* sdcc's run-time start-up calls this before it clears the memory; 0 = go on with that. At the 12
 * MHz after reset the clearing alone would take longer than everything this firmware does before it
 * releases the FPGA. */
unsigned char _sdcc_external_startup(void);

unsigned char _sdcc_external_startup(void)
{
    clock_start();
    return 0;
}
