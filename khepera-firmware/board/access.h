/* How code reaches the chip: registers, interrupt handlers, the interrupt mask, sleep.
 *
 * Tests on a PC put a header of the same name in this one's place, with registers in an array
 * (host-tests/khepera-firmware/fakes). */
#ifndef BOARD_ACCESS_H
#define BOARD_ACCESS_H

#include <stdint.h>

#define REG8(address)  (*(volatile uint8_t *)(address))
#define REG16(address) (*(volatile uint16_t *)(address))

/* Put before the definition of an interrupt handler. */
#define INTERRUPT __attribute__((interrupt_handler))

/* Before a large buffer: start-up does not clear it, which would take longer than the watchdog
 * waits. */
#define UNCLEARED __attribute__((section(".buffers")))

/* Mask all interrupts; returns what access_restore() wants. Keep the stretch between the two short:
 * an encoder edge must be read within half an edge's period, 140 us at 300 mm/s. */
static inline uint16_t access_mask(void)
{
    uint16_t status;

    __asm__ volatile("move.w %%sr, %0\n\tori.w #0x0700, %%sr" : "=d"(status) : : "memory", "cc");
    return status;
}

static inline void access_restore(uint16_t status)
{
    __asm__ volatile("move.w %0, %%sr" : : "d"(status) : "memory", "cc");
}

static inline void access_unmask(void)
{
    __asm__ volatile("andi.w #0xF8FF, %%sr" : : : "memory", "cc");
}

/* Unmask and sleep until the next interrupt, in one instruction: an interrupt that came between the
 * caller's last look (with interrupts masked) and this is not slept through. */
static inline void access_sleep(void)
{
    __asm__ volatile("stop #0x2000" : : : "memory", "cc");
}

#endif
