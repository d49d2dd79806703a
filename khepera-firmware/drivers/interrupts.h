/* Masking interrupts on a CPU32, and waiting for one. */
#ifndef DRIVERS_INTERRUPTS_H
#define DRIVERS_INTERRUPTS_H

#include <stdint.h>

/* Mask all interrupts; returns what interrupts_restore() wants. Keep the stretch between the two
 * short: an encoder edge must be read within half an edge's period, 140 us at 300 mm/s. */
static inline uint16_t interrupts_mask(void)
{
    uint16_t status;

    __asm__ volatile("move.w %%sr, %0\n\tori.w #0x0700, %%sr" : "=d"(status) : : "memory", "cc");
    return status;
}

static inline void interrupts_restore(uint16_t status)
{
    __asm__ volatile("move.w %0, %%sr" : : "d"(status) : "memory", "cc");
}

static inline void interrupts_enable(void)
{
    __asm__ volatile("andi.w #0xF8FF, %%sr" : : : "memory", "cc");
}

/* Set by every interrupt that leaves work for the main loop (a tick, a report, a character);
 * cleared by the main loop before it looks for that work. Encoder edges leave none. */
extern volatile uint8_t interrupts_work;

/* Unmask and sleep until the next interrupt, in one instruction: an interrupt that came between the
 * caller's last look (with interrupts masked) and this is not slept through. */
static inline void interrupts_wait(void)
{
    __asm__ volatile("stop #0x2000" : : : "memory", "cc");
}

#endif
