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
    uint32_t i = index_q8 >> 8;
    int32_t fraction = (int32_t)(index_q8 & 0xFFu);

    if (fraction == 0)
        return table[i];
    return table[i] + (((table[i + 1] - table[i]) * fraction + 128) >> 8);
}

int16_t angle_sin_q14(angle_t angle)
{
    uint16_t turn = (uint16_t)angle;
    uint16_t within = turn & 0x3FFFu;
    int32_t value;

    if (turn & 0x4000u)
        within = (uint16_t)(0x4000u - within);
    value = interpolate(sine_q14, within);
    return (int16_t)(turn & 0x8000u ? -value : value);
}

int16_t angle_cos_q14(angle_t angle)
{
    return angle_sin_q14(angle_wrap(angle + ANGLE_90));
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

uint32_t square_root(uint32_t square)
{
    uint32_t root = 0;
    uint32_t bit = 1ul << 30;

    while (bit > square)
        bit >>= 2;
    for (; bit != 0; bit >>= 2) {
        if (square >= root + bit) {
            square -= root + bit;
            root = (root >> 1) + bit;
        } else {
            root >>= 1;
        }
    }
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

angle_t angle_from_degrees(int32_t degrees)
{
    return angle_wrap(degrees * 65536 / 360);
}

int16_t angle_to_degrees(angle_t angle)
{
    return (int16_t)((angle * 360L + (angle < 0 ? -32768L : 32768L)) / 65536L);
}
