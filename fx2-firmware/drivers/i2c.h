/* The FX2's I2C master (TRM chapter 13): whole transfers, 400 kHz.
 *
 * On the bus are the boot EEPROM, the cameras' multiplexer and the cameras. A write and the read
 * that belongs to it are two transfers with a stop between them: cameras know no repeated start,
 * and an EEPROM does not need it. Longer reads are made of single ones, which an EEPROM continues
 * where it was: slower, but it saves a fifth of this driver.
 *
 * A byte takes 25 us; whoever holds the clock for ten times as long is given up. Nothing here may
 * be called from an interrupt. */
#ifndef DRIVERS_I2C_H
#define DRIVERS_I2C_H

#include <stdint.h>

typedef enum {
    I2C_OK = 0,
    I2C_NO_ACK = 1, /* nobody at that address, or it refused a byte */
    I2C_STUCK = 2   /* the clock line is held low; the transfer ends when it is let go */
} i2c_error_t;

/* What is written, and in the first place what was read. A program that writes more at once says so
 * to the compiler. */
#ifndef I2C_BYTES
#define I2C_BYTES 2u
#endif
extern uint8_t i2c_bytes[];

/* Choose 400 kHz. */
void i2c_init(void);

/* Write i2c_bytes[0..count-1], 0..I2C_BYTES bytes, to the device at the 7-bit address. Returns
 * I2C_*. */
uint8_t i2c_write(uint8_t address, uint8_t count);

/* Read one byte from it to i2c_bytes[0]. Returns I2C_*; on an error the byte means nothing. */
uint8_t i2c_read(uint8_t address);

#endif
