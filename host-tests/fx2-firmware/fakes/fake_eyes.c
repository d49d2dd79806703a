#include "host-tests/fx2-firmware/fakes/fake_eyes.h"

#include "board/turret.h"
#include "drivers/i2c.h"
#include "drivers/spi.h"
#include "link/camera.h"

#include <string.h>

fake_camera_t fake_cameras[2];
int fake_mux_present;
int fake_i2c_stuck;
int fake_i2c_transfers;
uint16_t fake_fpga_registers[FPGA_REG_COUNT];
uint8_t i2c_bytes[I2C_BYTES];

static uint8_t channel; /* what was written to the multiplexer */
static uint8_t pointer; /* the register that a read gives */

void fake_eyes_reset(void)
{
    static const uint16_t table[] = {0x1214, 0x40D0, FPGA_CAMERA_TABLE_END};
    int eye;

    memset(fake_cameras, 0, sizeof fake_cameras);
    memset(fake_fpga_registers, 0, sizeof fake_fpga_registers);
    for (eye = 0; eye < 2; eye++) {
        fake_cameras[eye].present = 1;
        fake_cameras[eye].registers[CAMERA_REG_PID] = CAMERA_PID;
        fake_cameras[eye].registers[CAMERA_REG_VER] = CAMERA_VER;
    }
    fake_mux_present = 1;
    fake_i2c_stuck = 0;
    fake_i2c_transfers = 0;
    channel = 0;
    fake_fpga_registers[FPGA_REG_ID] = FPGA_ID_VALUE;
    memcpy(fake_fpga_registers + FPGA_REG_CAMERA_TABLE, table, sizeof table);
    memcpy(fake_fpga_registers + FPGA_REG_CAMERA_TABLE + FPGA_CAMERA_TABLE_ENTRIES, table,
           sizeof table);
    fake_fpga_registers[FPGA_REG_CAMERA_TABLE + FPGA_CAMERA_TABLE_ENTRIES] = 0x1204;
}

void i2c_init(void) {}

/* The camera that the multiplexer lets through, if it is there. */
static fake_camera_t *reached(void)
{
    fake_camera_t *camera = NULL;

    if (channel == TURRET_CAMERA_MUX_LEFT)
        camera = &fake_cameras[0];
    if (channel == TURRET_CAMERA_MUX_RIGHT)
        camera = &fake_cameras[1];
    return camera && camera->present ? camera : NULL;
}

static void write_camera(fake_camera_t *camera, uint8_t count)
{
    pointer = i2c_bytes[0];
    if (count < 2)
        return;
    camera->registers[pointer] = i2c_bytes[1];
    camera->writes++;
    if (pointer == CAMERA_REG_COM7 && (i2c_bytes[1] & CAMERA_COM7_RESET)) {
        camera->resets++;
        camera->writes = 0;
    }
}

uint8_t i2c_write(uint8_t address, uint8_t count)
{
    fake_i2c_transfers++;
    if (fake_i2c_stuck)
        return I2C_STUCK;
    if (address == TURRET_CAMERA_MUX_ADDRESS && fake_mux_present) {
        channel = i2c_bytes[0];
        return I2C_OK;
    }
    if (address == TURRET_CAMERA_ADDRESS && reached()) {
        write_camera(reached(), count);
        return I2C_OK;
    }
    return I2C_NO_ACK;
}

uint8_t i2c_read(uint8_t address)
{
    fake_i2c_transfers++;
    if (fake_i2c_stuck)
        return I2C_STUCK;
    if (address != TURRET_CAMERA_ADDRESS || !reached())
        return I2C_NO_ACK;
    i2c_bytes[0] = reached()->registers[pointer];
    return I2C_OK;
}

uint16_t spi_register_read(uint8_t address)
{
    return fake_fpga_registers[FPGA_REG_ID] ? fake_fpga_registers[address] : 0xFFFFu;
}

void spi_register_write(uint8_t address, uint16_t value)
{
    fake_fpga_registers[address] = value;
}
