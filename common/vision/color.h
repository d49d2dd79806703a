/* Colour in integers.
 *
 * Pixels of the robot are RGB565: red in bits 15..11, green in 10..5, blue in 4..0. */
#ifndef VISION_COLOR_H
#define VISION_COLOR_H

#include <stdint.h>

/* 1 if the pixel is yellow as the ball is: divide-free, a few comparisons of sums in the FPGA. */
int color_is_yellow(uint16_t rgb565);

#endif
