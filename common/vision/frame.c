#include "vision/frame.h"

const uint16_t *frame_row(const frame_pair_t *frames, int eye, int row)
{
    if (row < 0)
        row = 0;
    if (row >= CAMERA_HEIGHT_PX)
        row = CAMERA_HEIGHT_PX - 1;
    return frames->pixels[eye] + (int32_t)row * CAMERA_WIDTH_PX;
}

/* Sum of one channel over two neighbours in both rows. */
#define SUM_OF_FOUR(channel)                                                                       \
    ((uint16_t)(channel(upper[0]) + channel(upper[1]) + channel(lower[0]) + channel(lower[1])))

#define RED_5(rgb565)   ((rgb565) >> 11)
#define GREEN_6(rgb565) (((rgb565) >> 5) & 0x3F)
#define BLUE_5(rgb565)  ((rgb565)&0x1F)

void frame_halve_rows(const uint16_t *upper, const uint16_t *lower, uint16_t *row)
{
    uint16_t x;

    for (x = 0; x < CAMERA_WIDTH_PX; x++) {
        uint16_t red = (uint16_t)((SUM_OF_FOUR(RED_5) + 2u) / 4u);
        uint16_t green = (uint16_t)((SUM_OF_FOUR(GREEN_6) + 2u) / 4u);
        uint16_t blue = (uint16_t)((SUM_OF_FOUR(BLUE_5) + 2u) / 4u);

        row[x] = (uint16_t)(red << 11 | green << 5 | blue);
        upper += 2;
        lower += 2;
    }
}
