#include "app/stream.h"

#include "drivers/slave_fifo.h"
#include "drivers/spi.h"
#include "link/registers.h"

/* In this order: the FPGA's pins float before anybody else may drive them. */
void stream_close(void)
{
    spi_register_write(FPGA_REG_STREAM, FPGA_STREAM_OFF);
    slave_fifo_close();
}

void stream_open(void)
{
    stream_close();
    slave_fifo_open();
}
