#include "vision/strips.h"

#include "vision/camera.h"
#include "vision/color.h"

/* Gaps in a strip are closed up to a sixth of what precedes them, and at least strip_gap pixels. */
#define GAP_SHARE       6
/* A blob goes on after at most this many rows without a strip: a seam lying level. */
#define GAP_ROWS        5
#define BLOB_MIN_STRIPS 4

void strips_begin(strips_t *strips)
{
    uint8_t i;

    for (i = 0; i < STRIPS_BLOBS; i++)
        strips->blobs[i].strips = 0;
}

/* First column from x on that is yellow (1) or not (0). */
static uint16_t next_column(const uint8_t *mask, uint16_t x, uint8_t yellow)
{
    while (x < CAMERA_WIDTH_PX && mask[x] != yellow)
        x++;
    return x;
}

int strips_next(const uint8_t *mask, uint8_t gap_min_px, uint16_t *x, uint16_t *first,
                uint16_t *last)
{
    uint16_t start = next_column(mask, *x, 1);
    uint16_t end = next_column(mask, start, 0);
    uint16_t length = (uint16_t)(end - start);

    if (!length)
        return 0;
    *first = start;
    *last = (uint16_t)(end - 1);
    for (;;) {
        uint16_t again = next_column(mask, end, 1);
        uint16_t gap = (uint16_t)(again - end);

        *x = again;
        if (gap > gap_min_px && gap > length / GAP_SHARE)
            return 1;
        end = next_column(mask, again, 0);
        /* Yellow specks beside a strip do not belong to it: what follows must outweigh the gap. */
        if (end - again <= gap)
            return 1;
        *last = (uint16_t)(end - 1);
        length = (uint16_t)(end - start);
    }
}

static int touches(const blob_t *blob, uint8_t row, uint16_t first, uint16_t last)
{
    return blob->strips && blob->bottom_row + GAP_ROWS >= row && blob->last_first <= last &&
           first <= blob->last_last;
}

/* A blob that has ended and is too flat to be a ball. */
static int is_speck(const blob_t *blob, uint8_t row)
{
    return blob->bottom_row + GAP_ROWS < row && blob->strips < BLOB_MIN_STRIPS;
}

/* The place for a new blob: a free one, or that of the blob with the narrowest widest strip. */
static blob_t *place_for(strips_t *strips, uint8_t row, uint16_t width_px)
{
    blob_t *narrowest = &strips->blobs[0];
    uint8_t i;

    for (i = 0; i < STRIPS_BLOBS; i++) {
        blob_t *blob = &strips->blobs[i];

        if (!blob->strips || is_speck(blob, row))
            return blob;
        if (blob->width_px < narrowest->width_px)
            narrowest = blob;
    }
    return narrowest->width_px < width_px ? narrowest : 0;
}

static void join(blob_t *blob, uint8_t row, uint16_t first, uint16_t last)
{
    uint16_t width_px = (uint16_t)(last - first + 1);

    /* A second strip in the same row widens the place where the next row may touch. */
    if (blob->bottom_row == row) {
        if (first < blob->last_first)
            blob->last_first = first;
        if (last > blob->last_last)
            blob->last_last = last;
    } else {
        blob->last_first = first;
        blob->last_last = last;
        blob->bottom_row = row;
        blob->strips++;
    }
    if (first < blob->outermost_first) {
        blob->first = blob->outermost_first;
        blob->outermost_first = first;
    } else if (first < blob->first) {
        blob->first = first;
    }
    if (last > blob->outermost_last) {
        blob->last = blob->outermost_last;
        blob->outermost_last = last;
    } else if (last > blob->last) {
        blob->last = last;
    }
    if (width_px > blob->width_px)
        blob->width_px = width_px;
}

static void take_strip(strips_t *strips, uint8_t row, uint16_t first, uint16_t last)
{
    uint16_t width_px = (uint16_t)(last - first + 1);
    blob_t *blob;
    uint8_t i;

    for (i = 0; i < STRIPS_BLOBS; i++) {
        if (touches(&strips->blobs[i], row, first, last)) {
            join(&strips->blobs[i], row, first, last);
            return;
        }
    }
    blob = place_for(strips, row, width_px);
    if (!blob)
        return;
    blob->last_first = blob->first = blob->outermost_first = first;
    blob->last_last = blob->last = blob->outermost_last = last;
    blob->width_px = width_px;
    blob->top_row = blob->bottom_row = row;
    blob->strips = 1;
}

void strips_row(strips_t *strips, uint8_t row, const uint16_t *rgb565, const eye_params_t *params)
{
    uint8_t mask[CAMERA_WIDTH_PX];
    uint16_t x = 0;
    uint16_t first;
    uint16_t last;

    color_yellow_mask(rgb565, CAMERA_WIDTH_PX, params, mask);
    while (strips_next(mask, params->strip_gap, &x, &first, &last))
        if (last - first + 1 >= params->strip_min)
            take_strip(strips, row, first, last);
}
