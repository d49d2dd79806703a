/* The GPIF's waveforms as they are loaded into the scratch RAM, beside the program; and their
 * timing.
 *
 * Not to see the declaration in gpif_waveforms.h: what the loader writes is program to sdcc, what
 * gpif.c reads there is data. */
#define WAVEFORMS_LAYOUT_ONLY
#include "drivers/gpif_waveforms.h"
#include "drivers/compiler.h"
#include "drivers/gpif_ctl.h"

/* Opcodes of a state, TRM table "GPIF waveform descriptors". */
#define OP_DECIDE 0x01u /* the state lasts one period, then branches */
#define OP_DATA   0x02u /* write: drive FD; read: sample FD */
#define OP_NEXT   0x04u /* on to the FIFO's next byte */
#define OP_INCAD  0x08u /* GPIFADR + 1 */

#define BRANCH(if_true, if_false) ((uint8_t)((if_true) << 3 | (if_false)))
#define IDLE                      7u
/* Functions of two ready inputs: 5 = transaction count expired (GPIFREADYCFG_TCXRDY5), 6 = FIFO
 * empty (EP2GPIFFLGSEL). */
#define LOGIC_TC_EXPIRED          0x2Du /* 5 and 5 */
#define LOGIC_EMPTY               0x36u /* 6 and 6 */
#define LOGIC_TC_OR_EMPTY         0x6Eu /* 5 or 6 */

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
 * FLASH_STREAM, states 1 + 3 + 1 = 5 T = 104 ns a byte, OE# low in all of them, CCLK high in S2:
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
 *                   leaves by the decision and never passes IDLE, whose length would add to it.
 *
 * USB_STREAM, states 1 + 1 = 2 T = 42 ns a byte while there are bytes: S1, then S2 with CCLK high:
 *   set-up          the byte is there since the beginning of S1: 1 T - 11 = 9.8 ns >= 5 ns (FPGA)
 *   hold            it goes with the end of S2: 1 T - 6.7 = 14 ns >= 0 ns (FPGA)
 *   CCLK            24 MHz, high for 1 T
 *   no byte         S2 sees the FIFO's empty flag after the byte has left it and turns aside; S0
 *                   waits for the host with CCLK low, and always goes on by S1, so that a byte
 *                   which came in its last moment has its set-up all the same. ASSUMPTION: the flag
 *                   is up to date at the end of the state that empties the FIFO
 *   count           S2 turns aside at its end as well, S3 then leaves: nothing depends on whether
 *                   the count is up to date one state earlier or later, because the FIFO of a host
 *                   that sends what it has announced is empty there in any case */
CODE AT(0xE18A) uint8_t gpif_waveforms[WAVEFORMS_SIZE] = {
    /* READ: lengths and branches, opcodes, outputs, logic */
    5, 1, BRANCH(IDLE, IDLE), 1,
    0, OP_DATA, OP_DECIDE | OP_INCAD, 0,
    WE_N, WE_N, WE_N, REST,
    0, 0, LOGIC_TC_EXPIRED, 0,
    /* WRITE */
    1, 3, 1, BRANCH(IDLE, IDLE),
    OP_DATA, OP_DATA, OP_DATA, OP_DECIDE,
    REST, OE_N, REST, REST,
    0, 0, 0, LOGIC_TC_EXPIRED,
    /* FLASH_STREAM */
    1, 3, BRANCH(IDLE, 0), 1,
    OP_DATA, 0, OP_DECIDE | OP_INCAD, 0,
    WE_N, WE_N, WE_N | CCLK, WE_N,
    0, 0, LOGIC_TC_EXPIRED, 0,
    /* USB_STREAM */
    BRANCH(0, 1), 1, BRANCH(3, 1), BRANCH(IDLE, 0),
    OP_DECIDE | OP_DATA, OP_DATA, OP_DECIDE | OP_DATA | OP_NEXT, OP_DECIDE | OP_DATA,
    REST, REST, REST | CCLK, REST,
    LOGIC_EMPTY, 0, LOGIC_TC_OR_EMPTY, LOGIC_TC_EXPIRED,
};
/* clang-format on */
