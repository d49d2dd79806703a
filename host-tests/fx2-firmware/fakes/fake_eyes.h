/* What is behind drivers/i2c.h and drivers/spi.h, for tests on the PC: multiplexer, two cameras,
 * and the FPGA's registers. fake_eyes_reset() mends everything. */
#ifndef FAKES_FAKE_EYES_H
#define FAKES_FAKE_EYES_H

#include "link/registers.h"

#include <stdint.h>

typedef struct {
    int present;
    uint8_t registers[256];
    int resets;
    int writes; /* since the last reset */
} fake_camera_t;

extern fake_camera_t fake_cameras[2];
extern int fake_mux_present;
extern int fake_i2c_stuck;
extern int fake_i2c_transfers;
extern uint16_t fake_fpga_registers[FPGA_REG_COUNT];

/* Cameras, multiplexer and a design with a table of three entries for either format. */
void fake_eyes_reset(void);

#endif
