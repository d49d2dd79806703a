#include "link/registers.h"

#include <string.h>

const fpga_register_t fpga_registers[FPGA_REGISTER_COUNT] = {
#define PLAIN(address, name, unit, reset, min, max, text)                                          \
    {address, 0, #name, unit, text, reset, min, max},
#define PARAM(address, name, unit, reset, min, max, text)                                          \
    {address, 1, #name, unit, text, reset, min, max},
    FPGA_REGISTERS(PLAIN, PARAM)
#undef PLAIN
#undef PARAM
};

const fpga_register_t *fpga_register_find(const char *name)
{
    uint8_t i;

    for (i = 0; i < FPGA_REGISTER_COUNT; i++)
        if (!strcmp(fpga_registers[i].name, name))
            return &fpga_registers[i];
    return 0;
}
