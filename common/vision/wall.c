#include "vision/wall.h"

#include "vision/camera.h"
#include "vision/color.h"

static const uint16_t columns[REPORT_WALL_COLUMNS] = {
    REPORT_WALL_COLUMN_LEFT, REPORT_WALL_COLUMN_CENTRE, REPORT_WALL_COLUMN_RIGHT};

typedef enum { WALL, PITCH, OTHER } surface_t;

void wall_begin(wall_finder_t *finder, const eye_params_t *params)
{
    int i;

    finder->params = params;
    for (i = 0; i < (int)REPORT_WALL_COLUMNS; i++)
        finder->row[i] = finder->above[i] = finder->below[i] = finder->barred[i] = 0;
}

static surface_t surface_at(const uint16_t *pixels, uint16_t column, const eye_params_t *params)
{
    uint16_t red = 0;
    uint16_t green = 0;
    uint16_t blue = 0;
    uint16_t x;

    for (x = column - WALL_COLUMNS / 2; x <= column + WALL_COLUMNS / 2; x++) {
        red = (uint16_t)(red + COLOR_RED(pixels[x]));
        green = (uint16_t)(green + COLOR_GREEN(pixels[x]));
        blue = (uint16_t)(blue + COLOR_BLUE(pixels[x]));
    }
    if (color_is_pitch(WALL_COLUMNS, red, green, blue, params))
        return PITCH;
    /* The ball; the same test as that of its strips. */
    if (red + green - 3 * blue > WALL_COLUMNS * params->yellow_margin &&
        100 * red > params->yellow_red * green)
        return OTHER;
    return WALL;
}

static void watch(wall_finder_t *finder, int i, uint8_t row, surface_t surface)
{
    uint8_t needed = finder->params->wall_rows;

    if (finder->row[i] || finder->barred[i])
        return;
    if (surface == PITCH) {
        if (finder->above[i] < needed)
            finder->barred[i] = row > needed;
        else if (++finder->below[i] == needed)
            finder->row[i] = (uint8_t)(row - needed + 1);
        return;
    }
    finder->below[i] = 0;
    finder->above[i] = (uint8_t)(surface == WALL ? finder->above[i] + 1 : 0);
}

void wall_row(wall_finder_t *finder, uint8_t row, const uint16_t *right)
{
    int i;

    for (i = 0; i < (int)REPORT_WALL_COLUMNS; i++)
        watch(finder, i, row, surface_at(right, columns[i], finder->params));
}

void wall_end(const wall_finder_t *finder, const opponent_extent_t *opponent, report_t *report)
{
    int i;

    for (i = 0; i < (int)REPORT_WALL_COLUMNS; i++) {
        int column_q4 = 16 * columns[i];

        if (!finder->row[i] ||
            (opponent->seen && column_q4 >= opponent->first_q4 && column_q4 <= opponent->last_q4))
            continue;
        report->flags |= REPORT_WALL;
        report->wall_row[i] = finder->row[i];
    }
}
