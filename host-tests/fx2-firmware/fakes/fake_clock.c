#include "host-tests/fx2-firmware/fakes/fake_clock.h"

#include "drivers/clock.h"

uint32_t fake_clock_now_us;
uint32_t fake_clock_step_us = 10;

static uint16_t wait_begun;

uint16_t clock_ticks(void)
{
    fake_clock_now_us += fake_clock_step_us;
    return (uint16_t)(fake_clock_now_us / CLOCK_TICK_US);
}

void clock_start_wait(void)
{
    wait_begun = clock_ticks();
}

uint8_t clock_waited(uint16_t limit)
{
    return (uint16_t)(clock_ticks() - wait_begun) > limit;
}
