/* Angles and plane geometry in fixed point, for a processor without floating point.
 *
 * An angle is a binary fraction of a turn: 65536 = 360 degrees, counter-clockwise (left) positive.
 * Wrapping around is then the integer's own. Pure functions; may be called from an interrupt. */
#ifndef SOCCER_ANGLE_H
#define SOCCER_ANGLE_H

#include <stdint.h>

typedef int16_t angle_t;

#define ANGLE_90         16384
#define ANGLE_DEGREES(d) ((angle_t)((d)*65536L / 360))

/* Bring any number of 1/65536 turns into -180..180 degrees. */
static inline angle_t angle_wrap(int32_t angle)
{
    uint16_t turn = (uint16_t)angle;

    return (angle_t)(turn < 0x8000u ? turn : (int32_t)turn - 65536L);
}

/* Sine and cosine, 1 = 16384; error below 1/8000. */
int16_t angle_sin_q14(angle_t angle);
int16_t angle_cos_q14(angle_t angle);

/* Direction of (x, y) seen from the origin: 0 along +x, +90 degrees along +y; error below 0.02
 * degrees for lengths of 1000 and more. (0, 0) gives 0. |x|, |y| < 2^31. */
angle_t angle_of(int32_t x, int32_t y);

/* Length of (x, y), rounded down; |x|, |y| < 2^29. Above 2^15 the lowest bits are lost. */
uint32_t length_of(int32_t x, int32_t y);

/* 1 if length_of(x, y) is below `radius`, up to 2^15; takes the root only where it is close. */
int is_within(int32_t x, int32_t y, uint32_t radius);

/* Square root, rounded down. */
uint32_t square_root(uint32_t square);

/* Conversions at the human border; degrees -3600..3600. */
angle_t angle_from_degrees(int32_t degrees);
int16_t angle_to_degrees(angle_t angle);

#endif
