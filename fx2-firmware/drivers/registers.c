#include "drivers/fx2_regs.h"

void registers_set(const __code register_value_t *table, uint8_t count)
{
    do {
        XREG(table->at) = table->value;
        SYNCDELAY();
        table++;
    } while (--count);
}
