#include "vision/color.h"

int color_is_yellow(uint16_t rgb565)
{
    /* All three on the scale 0..63. */
    int red = (rgb565 >> 11) * 2 + (rgb565 >> 15);
    int green = (rgb565 >> 5) & 63;
    int blue = (rgb565 & 31) * 2 + ((rgb565 >> 4) & 1);

    return red >= 12 && red > 2 * blue && green > blue && 4 * (green - blue) > red - blue &&
           8 * red > 7 * green;
}
