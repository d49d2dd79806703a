/* Firmware for the FX2's two data paths without a byte through the CPU: the slave FIFO fills EP6 IN
 * and empties EP2 OUT. The chip's own default device (RENUM = 0) answers the host; its alternate
 * setting 1 has both endpoints.
 *
 * Register addresses: EZ-USB Technical Reference Manual, chapter 15. */
#include <stdint.h>

#define REGISTER(address, name) static __xdata __at(address) volatile uint8_t name

REGISTER(0xE600, CPUCS);
REGISTER(0xE601, IFCONFIG);
REGISTER(0xE604, FIFORESET);
REGISTER(0xE60B, REVCTL);
REGISTER(0xE612, EP2CFG);
REGISTER(0xE613, EP4CFG);
REGISTER(0xE614, EP6CFG);
REGISTER(0xE615, EP8CFG);
REGISTER(0xE618, EP2FIFOCFG);
REGISTER(0xE61A, EP6FIFOCFG);
REGISTER(0xE624, EP6AUTOINLENH);
REGISTER(0xE625, EP6AUTOINLENL);

#define CPU_48MHZ     0x10u
#define SLAVE_30MHZ   0xA3u /* internal clock, driven out, slave FIFO */
#define NAK_ALL       0x80u
#define ENDPOINT_OFF  0x20u
#define BULK_OUT_QUAD 0xA0u
#define BULK_IN_QUAD  0xE0u
#define FIFO_WORDS    0x01u
#define FIFO_AUTOIN   0x08u
#define FIFO_AUTOOUT  0x10u
#define PACKET_SIZE   512u

/* SYNCDELAY at 48 MHz and IFCLK 30 MHz is 4 cycles (TRM 15.14). */
#define WRITE(name, value)                                                                         \
    do {                                                                                           \
        name = (value);                                                                            \
        __asm__("nop\n nop\n nop\n nop\n nop");                                                    \
    } while (0)

void main(void)
{
    WRITE(CPUCS, CPU_48MHZ);
    WRITE(REVCTL, 0);
    WRITE(IFCONFIG, SLAVE_30MHZ);
    WRITE(EP4CFG, ENDPOINT_OFF);
    WRITE(EP8CFG, ENDPOINT_OFF);
    WRITE(EP2CFG, BULK_OUT_QUAD);
    WRITE(EP6CFG, BULK_IN_QUAD);
    WRITE(FIFORESET, NAK_ALL);
    WRITE(FIFORESET, 2);
    WRITE(FIFORESET, 6);
    WRITE(FIFORESET, 0);
    WRITE(EP6AUTOINLENH, PACKET_SIZE >> 8);
    WRITE(EP6AUTOINLENL, PACKET_SIZE & 0xFFu);
    WRITE(EP6FIFOCFG, FIFO_AUTOIN | FIFO_WORDS);
    WRITE(EP2FIFOCFG, FIFO_WORDS);
    /* The edge of AUTOOUT arms all buffers. */
    WRITE(EP2FIFOCFG, FIFO_AUTOOUT | FIFO_WORDS);
    for (;;) {
        __asm__("orl 0x87, #1"); /* PCON.0, idle: nothing is left to do */
    }
}
