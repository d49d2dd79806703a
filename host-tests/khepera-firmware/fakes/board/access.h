/* In place of khepera-firmware/board/access.h: the chip as an array of registers that do nothing.
 *
 * A test puts in what a driver shall read, calls it or its interrupt handler, and looks at what it
 * wrote. A register of 16 bits and its two bytes are not the same place on every machine: a driver
 * under test uses each register in one width only. */
#ifndef BOARD_ACCESS_H
#define BOARD_ACCESS_H

#include <stdint.h>

extern uint8_t fake_registers[0x1000];
/* How deep interrupts are masked; 0 again after every call of a driver. */
extern int fake_masked;

#define REG8(address)  (*(volatile uint8_t *)&fake_registers[(address)&0xFFFu])
#define REG16(address) (*(volatile uint16_t *)(void *)&fake_registers[(address)&0xFFEu])

#define INTERRUPT
#define UNCLEARED

static inline uint16_t access_mask(void)
{
    return (uint16_t)fake_masked++;
}

static inline uint16_t access_mask_turret(void)
{
    return access_mask();
}

static inline void access_restore(uint16_t status)
{
    fake_masked = status;
}

static inline void access_unmask(void)
{
    fake_masked = 0;
}

static inline void access_sleep_until(volatile uint8_t *flag)
{
    (void)flag;
}

#define ACCESS_INCREMENT(variable) ((variable)++)
#define ACCESS_DECREMENT(variable) ((variable)--)

#endif
