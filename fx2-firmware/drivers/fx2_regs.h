/* The FX2's registers that this firmware uses, by the names of the EZ-USB Technical Reference
 * Manual (TRM); chapter 15 describes each.
 *
 * Only drivers/ includes this. */
#ifndef DRIVERS_FX2_REGS_H
#define DRIVERS_FX2_REGS_H

#include "drivers/compiler.h"

#include <stdint.h>

#define XREG(address)     (*(volatile __xdata uint8_t *)(address))
/* The address of one of the registers below, for tables. */
#define XREG_ADDRESS(reg) ((uint16_t)(&(reg)))

/* ---- Special function registers ---- */
__sfr __at(0x80) IOA;
__sfr __at(0x87) PCON;
__sfr __at(0x88) TCON;
__sfr __at(0x89) TMOD;
__sfr __at(0x8A) TL0;
__sfr __at(0x8C) TH0;
__sfr __at(0x8E) CKCON;
__sfr __at(0x91) EXIF;
__sfr __at(0xAA) EP2468STAT;
__sfr __at(0xA0) IOC;
__sfr __at(0xAB) EP24FIFOFLGS;
__sfr __at(0xB0) IOD;
__sfr __at(0xB1) IOE;
__sfr __at(0xB2) OEA;
__sfr __at(0xB4) OEC;
__sfr __at(0xB5) OED;
__sfr __at(0xB6) OEE;
__sfr __at(0xBB) GPIFTRIG;
__sfr __at(0xBE) GPIFSGLDATLX;   /* reading or writing it starts a single read or write */
__sfr __at(0xBF) GPIFSGLDATLNOX; /* reading it starts nothing */
__sfr __at(0xE8) EIE;

__sbit __at(0x8C) TR0;
__sbit __at(0x8D) TF0;
__sbit __at(0xA9) ET0;
__sbit __at(0xAF) EA;

#define PCON_IDLE 0x01u

#define EP2468STAT_EP2_EMPTY 0x01u
#define EP2468STAT_EP6_FULL  0x20u

#define EP24FIFOFLGS_EP2_EMPTY 0x02u

#define TMOD_T0_16BIT 0x01u
#define CKCON_T0M     0x08u /* timer 0 counts CLKOUT/4 instead of CLKOUT/12 */
#define CKCON_STRETCH 0x07u /* extra cycles of MOVX */

#define EXIF_USBINT 0x10u /* INT2 pending */
#define EIE_USB     0x01u /* enables INT2 */

#define INTERRUPT_TIMER0 1 /* vector 000B */
#define INTERRUPT_USB    8 /* INT2, vector 0043 */

#define GPIFTRIG_DONE 0x80u /* read: the GPIF is idle */
#define GPIFTRIG_READ 0x04u /* from the pins into the FIFO */
#define GPIFTRIG_EP2  0x00u
#define GPIFTRIG_EP6  0x02u

/* ---- GPIF waveform memory: 4 waveforms of 32 bytes (TRM 10.3) ---- */
#define GPIF_WAVEFORMS ((volatile __xdata uint8_t *)0xE400)

/* ---- General ---- */
#define CPUCS             XREG(0xE600)
#define CPUCS_48MHZ       0x10u
#define IFCONFIG          XREG(0xE601)
#define IFCONFIG_INTERNAL 0x80u /* IFCLK is made inside */
#define IFCONFIG_48MHZ    0x40u
#define IFCONFIG_OUTPUT   0x20u /* and driven out */
#define IFCONFIG_GPIF     0x02u
#define IFCONFIG_SLAVE    0x03u
#define FIFORESET         XREG(0xE604)
#define FIFORESET_NAKALL  0x80u

/* ---- Endpoints ---- */
#define EP1OUTCFG        XREG(0xE610)
#define EP1INCFG         XREG(0xE611)
#define EP2CFG           XREG(0xE612)
#define EP4CFG           XREG(0xE613)
#define EP6CFG           XREG(0xE614)
#define EP8CFG           XREG(0xE615)
#define EPCFG_INVALID    0x20u /* type bulk, but VALID = 0 */
#define EPCFG_VALID      0x80u
#define EPCFG_IN         0x40u
#define EPCFG_BULK       0x20u
#define EPCFG_QUAD       0x00u
#define EPCFG_DOUBLE     0x02u
#define EP2FIFOCFG       XREG(0xE618)
#define FIFOCFG_AUTOOUT  0x10u
#define EP4FIFOCFG       XREG(0xE619)
#define EP6FIFOCFG       XREG(0xE61A)
#define EP8FIFOCFG       XREG(0xE61B)
#define FIFOCFG_AUTOIN   0x08u
#define FIFOCFG_WORDWIDE 0x01u
#define EP6AUTOINLENH    XREG(0xE624)
#define EP6AUTOINLENL    XREG(0xE625)

/* ---- USB ---- */
#define EPIE           XREG(0xE65E)
#define EPIRQ          XREG(0xE65F)
#define EPIRQ_EP0IN    0x01u
#define EPIRQ_EP0OUT   0x02u
#define EPIRQ_EP2      0x10u
#define EPIRQ_EP6      0x40u
#define USBIE          XREG(0xE65C)
#define USBIRQ         XREG(0xE65D)
#define USBIRQ_SUDAV   0x01u
#define USBIRQ_SUSP    0x08u
#define USBIRQ_URES    0x10u
#define USBIRQ_HSGRANT 0x20u
#define INTSETUP       XREG(0xE668)
#define USBCS          XREG(0xE680)
#define USBCS_HSM      0x80u
#define USBCS_DISCON   0x08u
#define USBCS_RENUM    0x02u
#define EP0BCH         XREG(0xE68A)
#define EP0BCL         XREG(0xE68B)
#define EP0CS          XREG(0xE6A0)
#define EP0CS_HSNAK    0x80u /* written as 1: the status stage may be acknowledged */
#define EP0CS_BUSY     0x02u
#define EP0CS_STALL    0x01u
#define EP2BCH         XREG(0xE690)
#define EP2BCL         XREG(0xE691)
#define EPBCL_SKIP     0x80u /* OUT: give the buffer back to the host unread */
#define EP6BCH         XREG(0xE698)
#define EP6BCL         XREG(0xE699)
#define EP2CS          XREG(0xE6A3)
#define EP6CS          XREG(0xE6A5)
#define EPCS_STALL     0x01u
#define TOGCTL         XREG(0xE683)
#define TOGCTL_IN      0x10u
#define TOGCTL_RESET   0x20u
#define SETUPDAT       ((volatile __xdata uint8_t *)0xE6B8)

/* ---- I2C ---- */
#define I2CS         XREG(0xE678)
#define I2CS_START   0x80u
#define I2CS_STOP    0x40u
#define I2CS_LASTRD  0x20u
#define I2CS_ACK     0x02u
#define I2CS_DONE    0x01u
#define I2DAT        XREG(0xE679)
#define I2CTL        XREG(0xE67A)
#define I2CTL_400KHZ 0x01u

/* ---- Ports with two functions ---- */
#define PORTACFG        XREG(0xE670)
#define PORTCCFG        XREG(0xE671)
#define PORTECFG        XREG(0xE672)
#define PORTECFG_GPIFA8 0x80u

/* ---- GPIF ---- */
#define GPIFWFSELECT         XREG(0xE6C0)
#define GPIFIDLECS           XREG(0xE6C1)
#define GPIFIDLECTL          XREG(0xE6C2)
#define GPIFCTLCFG           XREG(0xE6C3)
#define GPIFADRH             XREG(0xE6C4)
#define GPIFADRL             XREG(0xE6C5)
#define FLOWSTATE            XREG(0xE6C6)
#define GPIFTCB3             XREG(0xE6CE)
#define GPIFTCB2             XREG(0xE6CF)
#define GPIFTCB1             XREG(0xE6D0)
#define GPIFTCB0             XREG(0xE6D1)
#define EP2GPIFFLGSEL        XREG(0xE6D2)
#define GPIFFLGSEL_EMPTY     0x01u
#define EP2GPIFPFSTOP        XREG(0xE6D3)
#define EP6GPIFPFSTOP        XREG(0xE6E3)
#define GPIFREADYCFG         XREG(0xE6F3)
#define GPIFREADYCFG_TCXRDY5 0x20u /* ready input 5 = transaction count expired */
#define GPIFREADYSTAT        XREG(0xE6F4)
#define GPIFABORT            XREG(0xE6F5)

/* A register and what to set it to: start-up tables take half the room of assignments. */
typedef struct {
    uint16_t at;
    uint8_t value;
} register_value_t;

/* Set `count` registers one after the other, with SYNCDELAY between them. In registers.c. */
void registers_set(const __code register_value_t *table, uint8_t count);

/* Some registers need a pause before the next access to one of them (TRM 15.14): ceil(1.5 *
 * (Tifclk / Tclkout + 1)) cycles, which are 3 with both clocks at 48 MHz. */
#define SYNCDELAY()                                                                                \
    do {                                                                                           \
        __asm__("nop\n nop\n nop");                                                                \
    } while (0)

#endif
