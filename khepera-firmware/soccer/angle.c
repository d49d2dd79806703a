#include "soccer/angle.h"

/* sin(i/64 * 90 degrees), 1 = 16384. */
static const int16_t sine_q14[65] = {
    0,     402,   804,   1205,  1606,  2006,  2404,  2801,  3196,  3590,  3981,  4370,  4756,
    5139,  5520,  5897,  6270,  6639,  7005,  7366,  7723,  8076,  8423,  8765,  9102,  9434,
    9760,  10080, 10394, 10702, 11003, 11297, 11585, 11866, 12140, 12406, 12665, 12916, 13160,
    13395, 13623, 13842, 14053, 14256, 14449, 14635, 14811, 14978, 15137, 15286, 15426, 15557,
    15679, 15791, 15893, 15986, 16069, 16143, 16207, 16261, 16305, 16340, 16364, 16379, 16384,
};

/* arctan(i/64), 8192 = 45 degrees. */
static const int16_t arc_tangent[65] = {
    0,    163,  326,  489,  651,  813,  975,  1136, 1297, 1457, 1617, 1775, 1933,
    2090, 2246, 2401, 2555, 2708, 2860, 3010, 3159, 3307, 3453, 3599, 3742, 3884,
    4025, 4164, 4302, 4438, 4572, 4705, 4836, 4966, 5094, 5220, 5344, 5467, 5589,
    5708, 5826, 5943, 6058, 6171, 6282, 6392, 6500, 6607, 6712, 6815, 6917, 7018,
    7117, 7214, 7310, 7405, 7498, 7589, 7679, 7768, 7856, 7942, 8026, 8110, 8192,
};

/* The table between its entries: index in its upper bits, 8 bits of fraction below. */
static int32_t interpolate(const int16_t *table, uint32_t index_q8)
{
    const int16_t *entry = table + (index_q8 >> 8);
    /* 16 bits times 16: the short multiplication of a 68331. */
    int16_t fraction = (int16_t)(index_q8 & 0xFFu);
    int16_t step;

    if (fraction == 0)
        return *entry;
    step = (int16_t)(entry[1] - entry[0]);
    return *entry + ((step * fraction + 128) >> 8);
}

static inline int16_t sine_of_turn(uint16_t turn)
{
    uint16_t within = turn & 0x3FFFu;
    int32_t value;

    if (turn & 0x4000u)
        within = (uint16_t)(0x4000u - within);
    value = interpolate(sine_q14, within);
    return (int16_t)(turn & 0x8000u ? -value : value);
}

int16_t angle_sin_q14(angle_t angle)
{
    return sine_of_turn((uint16_t)angle);
}

int16_t angle_cos_q14(angle_t angle)
{
    return sine_of_turn((uint16_t)((uint16_t)angle + ANGLE_90));
}

angle_t angle_of(int32_t x, int32_t y)
{
    uint32_t run = (uint32_t)(x < 0 ? -x : x);
    uint32_t rise = (uint32_t)(y < 0 ? -y : y);
    uint32_t longer = run > rise ? run : rise;
    uint32_t shorter = run > rise ? rise : run;
    int32_t angle;

    if (longer == 0)
        return 0;
    for (; longer >= 1ul << 17; longer >>= 1)
        shorter >>= 1;
    angle = interpolate(arc_tangent, (shorter << 14) / longer);
    if (rise > run)
        angle = ANGLE_90 - angle;
    if (x < 0)
        angle = 2 * ANGLE_90 - angle;
    return angle_wrap(y < 0 ? -angle : angle);
}

/* 16 * sqrt(64 + i + 1/2), rounded up. */
static const uint8_t root_guess_q4[192] = {
    129, 130, 131, 132, 133, 134, 135, 136, 137, 138, 139, 140, 140, 141, 142, 143, 144, 145,
    146, 147, 148, 148, 149, 150, 151, 152, 153, 154, 154, 155, 156, 157, 158, 158, 159, 160,
    161, 162, 162, 163, 164, 165, 166, 166, 167, 168, 169, 169, 170, 171, 172, 172, 173, 174,
    175, 175, 176, 177, 178, 178, 179, 180, 180, 181, 182, 183, 183, 184, 185, 185, 186, 187,
    187, 188, 189, 189, 190, 191, 191, 192, 193, 193, 194, 195, 195, 196, 197, 197, 198, 199,
    199, 200, 201, 201, 202, 203, 203, 204, 204, 205, 206, 206, 207, 208, 208, 209, 209, 210,
    211, 211, 212, 212, 213, 214, 214, 215, 215, 216, 217, 217, 218, 218, 219, 220, 220, 221,
    221, 222, 222, 223, 224, 224, 225, 225, 226, 226, 227, 228, 228, 229, 229, 230, 230, 231,
    232, 232, 233, 233, 234, 234, 235, 235, 236, 236, 237, 238, 238, 239, 239, 240, 240, 241,
    241, 242, 242, 243, 243, 244, 244, 245, 246, 246, 247, 247, 248, 248, 249, 249, 250, 250,
    251, 251, 252, 252, 253, 253, 254, 254, 255, 255, 255, 255,
};

uint32_t square_root(uint32_t square)
{
    uint32_t scaled = square;
    uint32_t root = 0;
    unsigned shift = 0;

    if (square < 64) {
        while ((root + 1) * (root + 1) <= square)
            root++;
        return root;
    }
    for (; scaled >= 1ul << 16; scaled >>= 8)
        shift += 4;
    if (scaled >= 4096) {
        scaled >>= 4;
        shift += 2;
    }
    for (; scaled >= 256; scaled >>= 2)
        shift++;
    /* One step of Newton's method makes the guess's 0.5 % less than one. */
    root = (uint32_t)root_guess_q4[scaled - 64] << shift >> 4;
    root = (root + square / root) >> 1;
    while (root > UINT16_MAX || root * root > square)
        root--;
    return root;
}

uint32_t length_of(int32_t x, int32_t y)
{
    uint32_t run = (uint32_t)(x < 0 ? -x : x);
    uint32_t rise = (uint32_t)(y < 0 ? -y : y);
    unsigned shift = 0;

    while (run >= 1ul << 15 || rise >= 1ul << 15) {
        run >>= 1;
        rise >>= 1;
        shift++;
    }
    return square_root(run * run + rise * rise) << shift;
}

int is_within(int32_t x, int32_t y, uint32_t radius)
{
    uint32_t run = (uint32_t)(x < 0 ? -x : x);
    uint32_t rise = (uint32_t)(y < 0 ? -y : y);

    if (run >= radius || rise >= radius)
        return 0;
    return run + rise < radius || length_of(x, y) < radius;
}

angle_t angle_from_degrees(int32_t degrees)
{
    return angle_wrap(degrees * 65536 / 360);
}

int16_t angle_to_degrees(angle_t angle)
{
    return (int16_t)((angle * 360L + (angle < 0 ? -32768L : 32768L)) / 65536L);
}
