#include "host-tests/fx2-firmware/fakes/fake_clock.h"

#include "drivers/clock.h"

uint32_t fake_clock_now_us;
uint32_t fake_clock_step_us = 10;

uint32_t clock_us(void)
{
    fake_clock_now_us += fake_clock_step_us;
    return fake_clock_now_us;
}

uint16_t clock_ticks(void)
{
    return (uint16_t)(clock_us() / 64u);
}
