/* Time for tests: every look at the clock takes a little of it, so that every wait ends. */
#ifndef FAKES_FAKE_CLOCK_H
#define FAKES_FAKE_CLOCK_H

#include <stdint.h>

extern uint32_t fake_clock_now_us;
/* Microseconds that one look takes. */
extern uint32_t fake_clock_step_us;

#endif
