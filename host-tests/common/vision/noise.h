/* Pictures and numbers for the tests of dense maps: the same on every machine. */
#ifndef NOISE_H
#define NOISE_H

#include <stdint.h>

/* Marsaglia's xorshift; a state of 0 would stay 0. */
static inline uint32_t noise_next(uint32_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

/* from .. to, both included. */
static inline uint32_t noise_between(uint32_t *state, uint32_t from, uint32_t to)
{
    return from + noise_next(state) % (to - from + 1);
}

/* A texture without end: the grey of any pixel, smooth over two of them. */
static inline uint8_t noise_texture(int x, int y)
{
    uint32_t sum = 0;
    int i;

    for (i = 0; i < 2; i++) {
        uint32_t state = (uint32_t)(x + i) * 2654435761u + (uint32_t)y * 40503u + 1u;

        noise_next(&state);
        noise_next(&state);
        sum += noise_next(&state) >> 24;
    }
    return (uint8_t)(sum / 2);
}

#endif
