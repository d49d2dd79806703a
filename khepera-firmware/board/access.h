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

/* The same for interrupts up to the turret's level (4) only: encoders and tick go on. Not from an
 * interrupt above that level. */
static inline uint16_t access_mask_turret(void)
{
    uint16_t status;

    __asm__ volatile("move.w %%sr, %0\n\tori.w #0x0400, %%sr" : "=d"(status) : : "memory", "cc");
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

/* Sleep until *flag is set, then return with interrupts masked. An interrupt that comes between the
 * look at the flag and the STOP is not slept through: STOP unmasks and sleeps in one. */
static inline void access_sleep_until(volatile uint8_t *flag)
{
    __asm__ volatile("1:\tori.w #0x0700, %%sr\n\t"
                     "tst.b %0\n\t"
                     "jne 2f\n\t"
                     "stop #0x2000\n\t"
                     "jra 1b\n"
                     "2:"
                     :
                     : "Q"(*flag)
                     : "memory", "cc");
}

/* Count a global variable up or down in one instruction that needs no register. */
#define ACCESS_INCREMENT(variable) __asm__ volatile("addq.l #1, " #variable : : : "memory", "cc")
#define ACCESS_DECREMENT(variable) __asm__ volatile("subq.l #1, " #variable : : : "memory", "cc")

#endif
