/* SPI to the FPGA's register file (link/registers.h), by software: port C's address pins of the
 * flash are its wires while the flash is not selected.
 *
 * The caller makes sure that no configuration is under way. A transfer takes 50 us. Without a
 * design in the FPGA every register reads FFFF and a write does nothing. Nothing here may be called
 * from an interrupt. */
#ifndef DRIVERS_SPI_H
#define DRIVERS_SPI_H

#include <stdint.h>

/* Value of the FPGA's register `address`, 00..7F; FFFF if there is none. */
uint16_t spi_register_read(uint8_t address);

/* Write it. The FPGA ignores values out of range and registers that are not writable. */
void spi_register_write(uint8_t address, uint16_t value);

#endif
