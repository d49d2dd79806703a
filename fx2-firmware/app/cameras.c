#include "app/cameras.h"

#include "board/turret.h"
#include "drivers/clock.h"
#include "drivers/i2c.h"
#include "drivers/spi.h"
#include "link/camera.h"
#include "link/registers.h"

/* A camera answers again a millisecond after a reset by register (OV7670 data sheet). */
#define RESET_TICKS CLOCK_TICKS(1000ul)
#define RETRY_TICKS CLOCK_TICKS(1000000ul)

uint8_t cameras_status[CAMERA_COUNT] = {CAMERA_UNKNOWN, CAMERA_UNKNOWN};
#define LEFT_STATUS  cameras_status[0]
#define RIGHT_STATUS cameras_status[1]

/* An 8051 has no room for a stack of parameters: the camera in question, and what went wrong first
 * with it. The drivers' errors are also ours. */
static uint8_t eye;
static uint8_t error; /* CAMERA_* */
typedef char errors_agree[CAMERA_NO_ACK == I2C_NO_ACK && CAMERA_BUS_STUCK == I2C_STUCK ? 1 : -1];

static uint16_t tried; /* clock_ticks() of the last set-up */

/* Both cameras have one address: the multiplexer lets one of them through. */
static void choose(uint8_t number)
{
    eye = number;
    i2c_bytes[0] = (uint8_t)(TURRET_CAMERA_MUX_LEFT + number);
    error = i2c_write(TURRET_CAMERA_MUX_ADDRESS, 1);
    if (error == CAMERA_NO_ACK)
        error = CAMERA_NO_MUX;
}

/* Nothing more is said to a camera that has failed. */
static void put(uint8_t reg, uint8_t value)
{
    i2c_bytes[0] = reg;
    i2c_bytes[1] = value;
    if (!error)
        error = i2c_write(TURRET_CAMERA_ADDRESS, 2);
}

static void get(uint8_t reg)
{
    i2c_bytes[0] = reg;
    if (!error)
        error = i2c_write(TURRET_CAMERA_ADDRESS, 1);
    if (!error)
        error = i2c_read(TURRET_CAMERA_ADDRESS);
}

static void expect(uint8_t reg, uint8_t value)
{
    get(reg);
    if (!error && i2c_bytes[0] != value)
        error = CAMERA_WRONG_ID;
}

static void reset(void)
{
    uint16_t began = clock_ticks();

    put(CAMERA_REG_COM7, CAMERA_COM7_RESET);
    while ((uint16_t)(clock_ticks() - began) <= RESET_TICKS)
        ;
}

/* Send the table for the present format. */
ONCE void send_table(void)
{
    uint8_t address = FPGA_REG_CAMERA_TABLE;
    uint8_t left = FPGA_CAMERA_TABLE_ENTRIES;

    if (spi_register_read(FPGA_REG_FORMAT) != FPGA_FORMAT_320X240)
        address += FPGA_CAMERA_TABLE_ENTRIES;
    do {
        uint16_t entry = spi_register_read(address);

        if (entry == FPGA_CAMERA_TABLE_END)
            break;
        put((uint8_t)(entry >> 8), (uint8_t)entry);
        address++;
    } while (--left);
}

static void setup(uint8_t number)
{
    if (spi_register_read(FPGA_REG_ID) != FPGA_ID_VALUE) {
        error = CAMERA_NO_FPGA;
        return;
    }
    choose(number);
    expect(CAMERA_REG_PID, CAMERA_PID);
    expect(CAMERA_REG_VER, CAMERA_VER);
    if (!error) {
        reset();
        send_table();
    }
}

static void setup_failed(void)
{
    tried = clock_ticks();
    if (LEFT_STATUS) {
        setup(0);
        LEFT_STATUS = error;
    }
    if (RIGHT_STATUS) {
        setup(1);
        RIGHT_STATUS = error;
    }
}

void cameras_setup(void)
{
    LEFT_STATUS = CAMERA_UNKNOWN;
    RIGHT_STATUS = CAMERA_UNKNOWN;
    setup_failed();
}

void cameras_step(void)
{
    if ((LEFT_STATUS | RIGHT_STATUS) && (uint16_t)(clock_ticks() - tried) > RETRY_TICKS)
        setup_failed();
}

/* An access by the host has ended. */
static uint8_t noted(void)
{
    if (error) {
        if (eye)
            RIGHT_STATUS = error;
        else
            LEFT_STATUS = error;
    }
    return error;
}

uint8_t camera_read(uint8_t number, uint8_t reg)
{
    choose(number);
    get(reg);
    return noted();
}

uint8_t camera_write(uint8_t number, uint8_t reg, uint8_t value)
{
    choose(number);
    put(reg, value);
    return noted();
}
