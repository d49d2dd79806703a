/* The two cameras, over I2C and the multiplexer: found, reset, and set up from the table that the
 * FPGA's design brings (link/registers.h).
 *
 * A camera that fails leaves the other one alone, and nothing is waited for longer than some
 * milliseconds. Nothing here may be called from an interrupt, nor while the flash is selected: the
 * table is read over SPI. */
#ifndef APP_CAMERAS_H
#define APP_CAMERAS_H

#include <stdint.h>

#define CAMERA_COUNT 2u

/* CAMERA_* (link/camera.h) of the left and of the right eye. */
extern uint8_t cameras_status[CAMERA_COUNT];

/* Set both up for the format that FPGA_REG_FORMAT names. Takes about 10 ms. */
void cameras_setup(void);

/* Try those again that failed, once a second: to be called whenever there is nothing else to do. */
void cameras_step(void);

/* Read register `reg` of camera `eye` (0 left, 1 right) to i2c_bytes[0] (drivers/i2c.h), or write
 * it. Returns CAMERA_*; a failure is kept in cameras_status. */
uint8_t camera_read(uint8_t eye, uint8_t reg);
uint8_t camera_write(uint8_t eye, uint8_t reg, uint8_t value);

#endif
