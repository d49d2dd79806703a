/* The pins by which the FPGA is configured: PROG#, INIT#, DONE and SelectMAP's chip select. The
 * bytes themselves come from the flash (drivers/flash_bus.h).
 *
 * May be called from anywhere but an interrupt. */
#ifndef DRIVERS_FPGA_PORT_H
#define DRIVERS_FPGA_PORT_H

#include <stdint.h>

/* Release PROG# and the chip select: a running FPGA goes on running. */
void fpga_port_init(void);

/* PROG#: 1 = pull it low, which erases the FPGA; 0 = let go. */
void fpga_port_program(uint8_t pull);

/* SelectMAP's CS#: 1 = selected, so that each rising CCLK takes a byte. */
void fpga_port_select(uint8_t selected);

/* Level of INIT#, 0 = low: low while the FPGA clears itself, and after it found a CRC error.
 * Without an FPGA: high (pull-up). */
uint8_t fpga_port_init_level(void);

/* Level of DONE, 0 = low: high when the FPGA runs its design. */
uint8_t fpga_port_done_level(void);

#endif
