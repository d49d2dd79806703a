#include "drivers/leds.h"

#include "board/khepera.h"
#include "board/mc68331.h"

void leds_show(uint8_t leds)
{
    PORTF = (uint8_t)((leds & 1u) << BOARD_PF_LED0 | (leds >> 1 & 1u) << BOARD_PF_LED1);
}
