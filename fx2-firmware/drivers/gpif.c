#include "drivers/gpif.h"

#include "board/turret.h"
#include "drivers/fx2_regs.h"
#include "drivers/gpif_ctl.h"

/* Opcodes of a state, TRM table "GPIF waveform descriptors". */
#define OP_DECIDE 0x01u /* the state lasts one period, then branches */
#define OP_DATA   0x02u /* write: drive FD; read: sample FD */
#define OP_INCAD  0x08u /* GPIFADR + 1 */

#define BRANCH(if_true, if_false) ((uint8_t)((if_true) << 3 | (if_false)))
#define IDLE                      7u
#define LOGIC_TC_EXPIRED          0x2Du /* ready input 5 AND itself; see GPIFREADYCFG_TCXRDY5 */

enum { WAVE_READ = 0, WAVE_WRITE = 1, WAVE_STREAM = 2, WAVE_BYTES = 32 };

/* clang-format off */
/* One IFCLK period is T = 20.83 ns. Delays from IFCLK to a pin (data sheet of the CY7C68013, GPIF
 * synchronous): CTL at most 6.7 ns, GPIFADR 7.5 ns, FD 11 ns, at least 0 each; FD must be there
 * 9.2 ns before the IFCLK edge that samples it.
 *
 * READ, states 5 + 1 + 1, OE# low in all of them:
 *   flash access    the address has stood still since before S0; S1 samples, at its beginning or at
 *                   its end: 5 T = 104 ns >= 70 (flash) + 7.5 + 9.2
 *   next address    counts up in S2, after the sample in either case
 *
 * WRITE, states 1 + 3 + 1 + 1:
 *   address, data   stand still from S0 on; WE# falls in S1: set-up of the address 1 T - 7.5 >= 0 ns
 *   WE# low         S1, 3 T = 62.5 ns, less 6.7: >= 45 ns
 *   data set-up     S0 and S1, 4 T - 11 = 72 ns before WE# rises: >= 45 ns
 *   data hold       S2, 1 T - 6.7 = 14 ns: >= 0 ns
 *
 * STREAM, states 1 + 3 + 1 = 5 T = 104 ns a byte, OE# low in all of them, CCLK high in S2:
 *   which edge      S2 counts the address up. If that shows at the end of S2, as we read the TRM,
 *                   the next byte has 4 T until CCLK rises again:
 *     set-up        4 T - 7.5 - 70 = 5.8 ns >= 5 ns (FPGA)
 *     hold          1 T - 6.7 = 14 ns >= 0 ns (FPGA)
 *                   If it shows at the beginning, set-up grows by 1 T, and the hold is the time the
 *                   flash needs to react to an address: 0 by its data sheet, in truth far more.
 *   CCLK            9.6 MHz, high for 1 T
 *   count           Each pass samples FD once, in S0, into a FIFO that is thrown away. The
 *                   transaction counter counts these samples; the decision in S2 comes three periods
 *                   later, so that it does not matter when exactly the count is taken. The loop
 *                   leaves by the decision and never passes IDLE, whose length would add to it. */
static const CODE uint8_t waveforms[3 * WAVE_BYTES] = {
    /* READ: lengths and branches, opcodes, outputs, logic */
    5, 1, BRANCH(IDLE, IDLE), 1, 1, 1, 1, 0,
    0, OP_DATA, OP_DECIDE | OP_INCAD, 0, 0, 0, 0, 0,
    WE_N, WE_N, WE_N, REST, REST, REST, REST, 0,
    0, 0, LOGIC_TC_EXPIRED, 0, 0, 0, 0, 0,
    /* WRITE */
    1, 3, 1, BRANCH(IDLE, IDLE), 1, 1, 1, 0,
    OP_DATA, OP_DATA, OP_DATA, OP_DECIDE, 0, 0, 0, 0,
    REST, OE_N, REST, REST, REST, REST, REST, 0,
    0, 0, 0, LOGIC_TC_EXPIRED, 0, 0, 0, 0,
    /* STREAM */
    1, 3, BRANCH(IDLE, 0), 1, 1, 1, 1, 0,
    OP_DATA, 0, OP_DECIDE | OP_INCAD, 0, 0, 0, 0, 0,
    WE_N, WE_N, WE_N | CCLK, WE_N, WE_N, WE_N, WE_N, 0,
    0, 0, LOGIC_TC_EXPIRED, 0, 0, 0, 0, 0,
};
/* clang-format on */

/* A single cycle takes at most 8 periods; the CPU is at least as long at reading GPIFTRIG. If the
 * GPIF should stand still all the same, waiting for it must end. */
#define SINGLE_POLLS 32u

static void load_waveforms(void)
{
    uint8_t i;

    for (i = 0; i < sizeof waveforms; i++)
        GPIF_WAVEFORMS[i] = waveforms[i];
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
     (WAVE_WRITE << 6) | (WAVE_READ << 4) | (WAVE_STREAM << 2) | WAVE_STREAM},
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
    {XREG_ADDRESS(EP6GPIFPFSTOP), 0}, /* the count ends a transaction, not the FIFO's flag */
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

uint8_t gpif_read_ones(uint8_t length)
{
    uint8_t ignored;

    do {
        START_READ();
        if (GPIFSGLDATLNOX != 0xFFu)
            return 0;
    } while (--length);
    (void)ignored;
    return 1;
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
