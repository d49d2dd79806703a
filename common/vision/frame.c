#include "vision/frame.h"

const uint16_t *frame_row(const frame_pair_t *frames, int eye, int row)
{
    if (row < 0)
        row = 0;
    if (row >= CAMERA_HEIGHT_PX)
        row = CAMERA_HEIGHT_PX - 1;
    return frames->pixels[eye] + (int32_t)row * CAMERA_WIDTH_PX;
}
