/* The two motors: pulse-width modulation (fast mode, 24.6 kHz) and direction. */
#ifndef DRIVERS_MOTORS_H
#define DRIVERS_MOTORS_H

#include <stdint.h>

#define MOTOR_FULL          255 /* largest duty, of 256 */
/* System clocks that the PWM's counter counts once; tick_fine() reads the time from it. */
#define MOTOR_CLOCK_DIVIDER 4u

/* Both motors off, pins under control. Call once. */
void motors_init(void);

/* Duty of both, -MOTOR_FULL..MOTOR_FULL, clamped; positive = forward. May be called from an
 * interrupt. */
void motors_drive(int16_t left, int16_t right);

#endif
