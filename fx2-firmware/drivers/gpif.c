#include "drivers/gpif.h"

#include "board/turret.h"
#include "drivers/fx2_regs.h"
#include "drivers/gpif_ctl.h"
#include "drivers/gpif_waveforms.h"

/* A single cycle takes at most 8 periods; the CPU is at least as long at reading GPIFTRIG. If the
 * GPIF should stand still all the same, waiting for it must end. */
#define SINGLE_POLLS 32u

ONCE void load_waveforms(void)
{
    const XDATA uint8_t *from = gpif_waveforms;
    volatile XDATA uint8_t *to = GPIF_WAVEFORMS;
    uint8_t i = 0;

    do {
        *to++ = *from++;
        if (++i % WAVE_STATES == 0)
            to += WAVE_PLACES - WAVE_STATES;
    } while (i != WAVEFORMS_SIZE);
}

static const CODE register_value_t setup[] = {
    {XREG_ADDRESS(GPIFABORT), 0xFF},
    {XREG_ADDRESS(IFCONFIG), IFCONFIG_INTERNAL | IFCONFIG_48MHZ | IFCONFIG_OUTPUT | IFCONFIG_GPIF},
    {XREG_ADDRESS(GPIFCTLCFG), 0},
    {XREG_ADDRESS(GPIFIDLECS), 0}, /* FD floats while the GPIF is idle */
    {XREG_ADDRESS(GPIFIDLECTL), REST},
    /* RDY pins go through two flip-flops: they are asynchronous. */
    {XREG_ADDRESS(GPIFREADYCFG), GPIFREADYCFG_TCXRDY5},
    {XREG_ADDRESS(GPIFWFSELECT),
     (WAVE_WRITE << 6) | (WAVE_READ << 4) | (WAVE_USB_STREAM << 2) | WAVE_FLASH_STREAM},
    {XREG_ADDRESS(FLOWSTATE), 0},
    {XREG_ADDRESS(PORTACFG), 0},
    /* Address pins. */
    {XREG_ADDRESS(PORTCCFG), 0xFF},
    {XREG_ADDRESS(PORTECFG), PORTECFG_GPIFA8},
    /* WORDWIDE = 0 in all four, or port D would be FD[15:8]. */
    {XREG_ADDRESS(EP2FIFOCFG), 0},
    {XREG_ADDRESS(EP4FIFOCFG), 0},
    {XREG_ADDRESS(EP6FIFOCFG), 0},
    {XREG_ADDRESS(EP8FIFOCFG), 0},
    /* EP6 is the FIFO that takes the stream's samples, which are never committed to USB. */
    {XREG_ADDRESS(EP6CFG), EPCFG_VALID | EPCFG_IN | EPCFG_BULK | EPCFG_QUAD},
    /* The count ends a transaction, not the FIFO's flag, which is "empty" for EP2. */
    {XREG_ADDRESS(EP2GPIFPFSTOP), 0},
    {XREG_ADDRESS(EP6GPIFPFSTOP), 0},
    {XREG_ADDRESS(EP2GPIFFLGSEL), GPIFFLGSEL_EMPTY},
};

void gpif_init(void)
{
    registers_set(setup, sizeof setup / sizeof setup[0]);
    load_waveforms();
    OEC = 0xFF;
}

void gpif_set_offset(uint16_t offset)
{
    SYNCDELAY();
    GPIFADRH = (uint8_t)(offset >> 8);
    SYNCDELAY();
    GPIFADRL = (uint8_t)offset;
    SYNCDELAY();
}

static void wait_single(void)
{
    uint8_t polls = SINGLE_POLLS;

    while (!(GPIFTRIG & GPIFTRIG_DONE)) {
        if (--polls == 0) {
            GPIFABORT = 0xFF;
            return;
        }
    }
}

/* One read cycle. The first access starts it and returns a byte of an earlier one; the cycle is
 * over about when DONE is looked at first. */
#define START_READ()                                                                               \
    do {                                                                                           \
        ignored = GPIFSGLDATLX;                                                                    \
        SYNCDELAY();                                                                               \
        if (!(GPIFTRIG & GPIFTRIG_DONE))                                                           \
            wait_single();                                                                         \
    } while (0)

void gpif_read(XDATA uint8_t *data, uint8_t length)
{
    uint8_t ignored;

    do {
        START_READ();
        *data++ = GPIFSGLDATLNOX;
    } while (--length);
    (void)ignored;
}

void gpif_write(uint8_t value)
{
    GPIFSGLDATLX = value;
    SYNCDELAY();
    wait_single();
}

uint8_t gpif_ready_pins(void)
{
    return GPIFREADYSTAT;
}
