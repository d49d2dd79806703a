#include "drivers/leds.h"

#include "board/khepera.h"
#include "board/mc68331.h"

#define LED_PINS ((1u << BOARD_PF_LED0) | (1u << BOARD_PF_LED1))

void leds_init(void)
{
    PORTF = 0;
    DDRF = LED_PINS | 1u << BOARD_PF_EMITTERS;
}

void leds_show(uint8_t leds)
{
    uint16_t status = access_mask(); /* the emitters' pin is changed by an interrupt */

    PORTF = (uint8_t)((PORTF & ~LED_PINS) | (leds & 1u) << BOARD_PF_LED0 |
                      (leds >> 1 & 1u) << BOARD_PF_LED1);
    access_restore(status);
}
