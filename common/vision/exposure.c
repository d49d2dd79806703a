#include "vision/exposure.h"

#include "vision/camera.h"
#include "vision/color.h"

/* A change of the mean that only exposure or light can make, and one that is none, as shares. */
#define JUMP_SHARE 4u
#define CALM_SHARE 32u

void exposure_reset(exposure_watch_t *watch)
{
    watch->sum = watch->before = 0;
    watch->calm = watch->frames_left = 0;
}

void exposure_row(exposure_watch_t *watch, const uint16_t *rgb565)
{
    uint32_t sum = 0;
    uint16_t x;

    for (x = 0; x < CAMERA_WIDTH_PX; x++)
        sum += (uint32_t)COLOR_GREEN(rgb565[x]);
    watch->sum += sum;
}

int exposure_end(exposure_watch_t *watch)
{
    uint32_t before = watch->before;
    uint32_t now = watch->sum;
    uint32_t change = now > before ? now - before : before - now;

    watch->before = now;
    watch->sum = 0;
    if (before && JUMP_SHARE * change > before) {
        watch->frames_left = EXPOSURE_MAX_FRAMES;
        watch->calm = 0;
    }
    if (!watch->frames_left)
        return 0;
    watch->calm = (uint8_t)(CALM_SHARE * change < before ? watch->calm + 1 : 0);
    watch->frames_left--;
    if (watch->calm >= EXPOSURE_CALM_FRAMES)
        watch->frames_left = 0;
    return watch->frames_left > 0;
}
