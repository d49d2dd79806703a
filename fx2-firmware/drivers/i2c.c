#include "drivers/i2c.h"

#include "drivers/fx2_regs.h"

uint8_t i2c_bytes[I2C_BYTES];

void i2c_init(void)
{
    I2CTL = I2CTL_400KHZ;
}

/* Wait until the byte on its way is over: 256 polls of 10 cycles, 210 us. */
static uint8_t await_done(void)
{
    uint8_t polls = 0;

    do {
        uint8_t status = I2CS;

        if (status & I2CS_DONE)
            return status & I2CS_ACK ? I2C_OK : I2C_NO_ACK;
    } while (--polls);
    return I2C_STUCK;
}

static uint8_t send(uint8_t byte)
{
    I2DAT = byte;
    return await_done();
}

static uint8_t begin(uint8_t address_and_direction)
{
    uint8_t polls = 0;

    while (I2CS & I2CS_STOP) /* of the transfer before */
        if (--polls == 0)
            return I2C_STUCK;
    I2CS = I2CS_START;
    return send(address_and_direction);
}

uint8_t i2c_write(uint8_t address, uint8_t count)
{
    uint8_t error = begin((uint8_t)(address << 1));
    uint8_t i;

    for (i = 0; !error && i != count; i++)
        error = send(i2c_bytes[i]);
    I2CS = I2CS_STOP;
    return error;
}

uint8_t i2c_read(uint8_t address)
{
    uint8_t error = begin((uint8_t)(address << 1 | 1u));

    if (!error) {
        I2CS = I2CS_LASTRD;   /* the byte that the fetch starts is the last: */
        i2c_bytes[0] = I2DAT; /* nothing yet */
        error = await_done(); /* which we do not acknowledge ourselves */
        if (error == I2C_NO_ACK)
            error = I2C_OK;
    }
    I2CS = I2CS_STOP;
    i2c_bytes[0] = I2DAT;
    return error;
}
