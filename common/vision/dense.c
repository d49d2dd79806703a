#include "vision/dense.h"

#include "vision/color.h"
#include "vision/multiversion.h"

#define FULL_HUE 180 /* color.h: 2 degrees a unit */

static int higher_is_better(match_method_t method)
{
    return method == MATCH_CORR || method == MATCH_NCC;
}

/* What a pass over the pictures works on. All rows hold one word for each pixel of a row; entry x
 * of a sum belongs to the block whose left column is x. */
typedef struct {
    const dense_eye_t *left;
    const dense_eye_t *right;
    const dense_params_t *params;
    uint32_t width;
    uint32_t *columns;      /* [disparities][width]: costs added up over the rows of the window */
    uint32_t *energy[2];    /* NCC: squares added up over the window, of left and right */
    uint32_t *buffers[2];   /* for box_sums */
    const uint8_t *nothing; /* a row of zeros: what leaves the window while it fills */
    uint32_t *best;         /* the best cost so far */
    uint32_t *best_at;      /* its disparity */
    uint32_t *best_energy;  /* NCC: energy of the other eye's block there */
    uint32_t *energy_buffers[2];
} pass_t;

#define ROW_BUFFERS     5u
#define NCC_ROW_BUFFERS 5u

static int params_fit(const dense_params_t *p)
{
    return p->method <= MATCH_NCC && p->planes >= 1 && p->planes <= DENSE_MAX_PLANES &&
           p->block >= 1 && p->block <= MATCH_MAX_BLOCK && p->disparities >= 1 &&
           p->disparities <= DENSE_MAX_DISPARITIES;
}

uint32_t dense_work_words(uint16_t width, const dense_params_t *params)
{
    uint32_t rows = ROW_BUFFERS;

    if (!params_fit(params) || width == 0 || width > DENSE_MAX_SIDE)
        return 0;
    if (params->method == MATCH_NCC)
        rows += NCC_ROW_BUFFERS;
    return (rows + params->disparities) * width;
}

static void share_out(pass_t *pass, uint32_t *work)
{
    uint32_t width = pass->width;

    pass->columns = work;
    work += pass->params->disparities * width;
    pass->buffers[0] = work;
    pass->buffers[1] = work + width;
    pass->best = work + 2 * width;
    pass->best_at = work + 3 * width;
    pass->nothing = (const uint8_t *)(work + 4 * width);
    if (pass->params->method == MATCH_NCC) {
        pass->energy[0] = work + 5 * width;
        pass->energy[1] = work + 6 * width;
        pass->best_energy = work + 7 * width;
        pass->energy_buffers[0] = work + 8 * width;
        pass->energy_buffers[1] = work + 9 * width;
    }
}

/* A row of both eyes, or of one eye twice. */
typedef struct {
    const uint8_t *a;
    const uint8_t *b;
} rows_t;

/* sums[x] += cost of the pixels that enter the window - cost of those that leave it. Unsigned sums
 * wrap and come back. */
MULTIVERSION
static void slide_sad(rows_t in, rows_t out, uint32_t n, uint32_t *restrict sums)
{
    uint32_t x;

    for (x = 0; x < n; x++) {
        uint8_t high_in = in.a[x] > in.b[x] ? in.a[x] : in.b[x];
        uint8_t low_in = in.a[x] > in.b[x] ? in.b[x] : in.a[x];
        uint8_t high_out = out.a[x] > out.b[x] ? out.a[x] : out.b[x];
        uint8_t low_out = out.a[x] > out.b[x] ? out.b[x] : out.a[x];
        int32_t change = (high_in - low_in) - (high_out - low_out);

        sums[x] += (uint32_t)change;
    }
}

MULTIVERSION
static void slide_ssd(rows_t in, rows_t out, uint32_t n, uint32_t *restrict sums)
{
    uint32_t x;

    for (x = 0; x < n; x++) {
        int16_t difference_in = (int16_t)(in.a[x] - in.b[x]);
        int16_t difference_out = (int16_t)(out.a[x] - out.b[x]);

        sums[x] += (uint32_t)(difference_in * difference_in - difference_out * difference_out);
    }
}

MULTIVERSION
static void slide_product(rows_t in, rows_t out, uint32_t n, uint32_t *restrict sums)
{
    uint32_t x;

    for (x = 0; x < n; x++)
        sums[x] += (uint32_t)(in.a[x] * in.b[x] - out.a[x] * out.b[x]);
}

static inline int hue_difference(uint8_t a, uint8_t b)
{
    int way = a > b ? a - b : b - a;

    return way > FULL_HUE - way ? FULL_HUE - way : way;
}

MULTIVERSION
static void slide_hue(rows_t in, rows_t out, uint32_t n, int squared, uint32_t *restrict sums)
{
    uint32_t x;

    for (x = 0; x < n; x++) {
        int way_in = hue_difference(in.a[x], in.b[x]);
        int way_out = hue_difference(out.a[x], out.b[x]);

        sums[x] += (uint32_t)(squared ? way_in * way_in - way_out * way_out : way_in - way_out);
    }
}

static void slide_plane(const dense_params_t *params, int is_hue, rows_t in, rows_t out, uint32_t n,
                        uint32_t *sums)
{
    if (higher_is_better(params->method))
        slide_product(in, out, n, sums);
    else if (is_hue)
        slide_hue(in, out, n, params->method == MATCH_SSD, sums);
    else if (params->method == MATCH_SSD)
        slide_ssd(in, out, n, sums);
    else
        slide_sad(in, out, n, sums);
}

/* Rows of the two eyes at disparity d: as many pixels of both as have a partner. */
static rows_t partners(rows_t rows, uint32_t d)
{
    rows_t moved = {rows.a + d, rows.b};

    return moved;
}

static rows_t twice(const uint8_t *row)
{
    rows_t rows = {row, row};

    return rows;
}

/* Let row y enter the window and the row one block above it leave, if there is one. Column x of
 * disparity d belongs to reference pixel x; columns without a partner in the other eye stay 0 and
 * are never used. */
static void slide_window(const pass_t *pass, uint32_t y)
{
    const dense_params_t *params = pass->params;
    uint32_t stride = pass->left->stride;
    uint32_t plane;
    uint32_t d;

    for (plane = 0; plane < params->planes; plane++) {
        const uint8_t *left = pass->left->planes[plane] + y * stride;
        const uint8_t *right = pass->right->planes[plane] + y * stride;
        rows_t in = {left, right};
        rows_t out = twice(pass->nothing);

        if (y >= params->block) {
            out.a = left - params->block * stride;
            out.b = right - params->block * stride;
        }
        for (d = 0; d < params->disparities && d < pass->width; d++)
            slide_plane(params, params->hue_first && plane == 0, partners(in, d), partners(out, d),
                        pass->width - d,
                        pass->columns + d * pass->width + (params->reference_is_right ? 0 : d));
        if (params->method == MATCH_NCC) {
            slide_product(twice(in.a), twice(out.a), pass->width, pass->energy[0]);
            slide_product(twice(in.b), twice(out.b), pass->width, pass->energy[1]);
        }
    }
}

/* wide[x] = sums[x] + sums[x + span], and the column after both if asked for. Pointers, because the
 * compiler must allow for an index x + span that wraps, and then finds no vectors. */
MULTIVERSION
static void double_span(const uint32_t *restrict sums, uint32_t span, int and_column,
                        const uint32_t *restrict columns, uint32_t n, uint32_t *restrict wide)
{
    const uint32_t *second = sums + span;
    const uint32_t *column = columns + 2 * span;
    uint32_t x;

    if (and_column)
        for (x = 0; x < n; x++)
            wide[x] = sums[x] + second[x] + column[x];
    else
        for (x = 0; x < n; x++)
            wide[x] = sums[x] + second[x];
}

/* The sums of `block` columns at n places, in one of the two buffers or in the columns themselves.
 * The binary digits of `block` from the second on say whether a doubled span takes a column more.
 */
static const uint32_t *box_sums(const uint32_t *columns, uint32_t n, uint32_t block,
                                uint32_t *buffer, uint32_t *other)
{
    const uint32_t *sums = columns;
    uint32_t span = 1;
    uint32_t digit = 1;

    while (2 * digit <= block)
        digit *= 2;
    for (digit /= 2; digit; digit /= 2) {
        uint32_t *wide = buffer;
        int and_column = (block & digit) != 0;
        uint32_t wide_span = 2 * span + (uint32_t)and_column;

        double_span(sums, span, and_column, columns, n + block - wide_span, wide);
        buffer = other;
        other = wide;
        sums = wide;
        span = wide_span;
    }
    return sums;
}

/* Ties stay with the smaller disparity: those come first. */
MULTIVERSION
static void keep_lowest(const uint32_t *sums, uint32_t n, uint32_t d, uint32_t *best,
                        uint32_t *best_at)
{
    uint32_t x;

    for (x = 0; x < n; x++) {
        best_at[x] = sums[x] < best[x] ? d : best_at[x];
        best[x] = sums[x] < best[x] ? sums[x] : best[x];
    }
}

MULTIVERSION
static void keep_highest(const uint32_t *sums, uint32_t n, uint32_t d, uint32_t *best,
                         uint32_t *best_at)
{
    uint32_t x;

    for (x = 0; x < n; x++) {
        best_at[x] = sums[x] > best[x] ? d : best_at[x];
        best[x] = sums[x] > best[x] ? sums[x] : best[x];
    }
}

/* product_a^2 / energy_a > product_b^2 / energy_b, without rounding: both sides times both energies
 * are 96 bits wide. The reference block's own energy is the same on both sides. A block of zeros
 * correlates with nothing; its energy counts as 1 so that the product, 0, decides. */
static int correlates_better(uint32_t product_a, uint32_t energy_a, uint32_t product_b,
                             uint32_t energy_b)
{
    uint64_t square_a = (uint64_t)product_a * product_a;
    uint64_t square_b = (uint64_t)product_b * product_b;
    uint32_t times_a = energy_b ? energy_b : 1;
    uint32_t times_b = energy_a ? energy_a : 1;
    uint64_t low_a = (square_a & UINT32_MAX) * times_a;
    uint64_t low_b = (square_b & UINT32_MAX) * times_b;
    uint64_t high_a = (square_a >> 32) * times_a + (low_a >> 32);
    uint64_t high_b = (square_b >> 32) * times_b + (low_b >> 32);

    return high_a > high_b || (high_a == high_b && (uint32_t)low_a > (uint32_t)low_b);
}

static void keep_best_correlated(const uint32_t *sums, const uint32_t *energy, uint32_t n,
                                 uint32_t d, uint32_t *best, uint32_t *best_energy,
                                 uint32_t *best_at)
{
    uint32_t x;

    for (x = 0; x < n; x++) {
        if (!correlates_better(sums[x], energy[x], best[x], best_energy[x]))
            continue;
        best_at[x] = d;
        best[x] = sums[x];
        best_energy[x] = energy[x];
    }
}

static void forget_best(const pass_t *pass)
{
    uint32_t worst = higher_is_better(pass->params->method) ? 0 : UINT32_MAX;
    uint32_t x;

    for (x = 0; x < pass->width; x++) {
        pass->best[x] = worst;
        pass->best_at[x] = 0; /* always a candidate, and the first among equals */
        if (pass->params->method == MATCH_NCC)
            pass->best_energy[x] = 0;
    }
}

/* Find the best disparity of every block of the window's rows. */
static void search_row(const pass_t *pass)
{
    const dense_params_t *params = pass->params;
    uint32_t places = pass->width - params->block + 1;
    const uint32_t *energy = 0;
    uint32_t d;

    forget_best(pass);
    if (params->method == MATCH_NCC)
        energy = box_sums(pass->energy[!params->reference_is_right], places, params->block,
                          pass->energy_buffers[0], pass->energy_buffers[1]);
    for (d = 0; d < params->disparities && d < places; d++) {
        uint32_t first = params->reference_is_right ? 0 : d; /* x - d must be in the picture */
        uint32_t other = params->reference_is_right ? d : 0; /* and so must x + d */
        uint32_t n = places - d;
        const uint32_t *sums = box_sums(pass->columns + d * pass->width + first, n, params->block,
                                        pass->buffers[0], pass->buffers[1]);

        if (params->method == MATCH_NCC)
            keep_best_correlated(sums, energy + other, n, d, pass->best + first,
                                 pass->best_energy + first, pass->best_at + first);
        else if (params->method == MATCH_CORR)
            keep_highest(sums, n, d, pass->best + first, pass->best_at + first);
        else
            keep_lowest(sums, n, d, pass->best + first, pass->best_at + first);
    }
}

static void fill_row(int16_t *out, uint32_t width)
{
    uint32_t x;

    for (x = 0; x < width; x++)
        out[x] = DENSE_INVALID_Q4;
}

static void put_row(const pass_t *pass, int16_t *out)
{
    uint32_t block = pass->params->block;
    uint32_t x;

    fill_row(out, pass->width);
    for (x = 0; x + block <= pass->width; x++)
        out[x + block / 2] = (int16_t)(16 * (int32_t)pass->best_at[x]);
}

static dense_error_t check(const dense_eye_t *left, const dense_eye_t *right,
                           const dense_params_t *params, uint32_t work_words, uint16_t out_stride)
{
    if (!params_fit(params) || left->width != right->width || left->height != right->height ||
        left->stride != right->stride || left->stride < left->width || out_stride < left->width ||
        left->width == 0 || left->width > DENSE_MAX_SIDE || left->height == 0 ||
        left->height > DENSE_MAX_SIDE)
        return DENSE_BAD_PARAM;
    if (left->width < params->block || left->height < params->block)
        return DENSE_TOO_SMALL;
    if (work_words < dense_work_words(left->width, params))
        return DENSE_NO_MEMORY;
    return DENSE_OK;
}

dense_error_t dense_map(const dense_eye_t *left, const dense_eye_t *right,
                        const dense_params_t *params, uint32_t *work, uint32_t work_words,
                        int16_t *disparity_q4, uint16_t out_stride)
{
    dense_error_t error = check(left, right, params, work_words, out_stride);
    pass_t pass = {0};
    uint32_t block = params->block;
    uint32_t y;

    if (error != DENSE_OK)
        return error;
    pass.left = left;
    pass.right = right;
    pass.params = params;
    pass.width = left->width;
    share_out(&pass, work);
    for (y = 0; y < dense_work_words(left->width, params); y++)
        work[y] = 0;
    for (y = 0; y < block / 2; y++)
        fill_row(disparity_q4 + y * out_stride, pass.width);
    for (y = 0; y < left->height; y++) {
        slide_window(&pass, y);
        if (y + 1 < block)
            continue;
        search_row(&pass);
        put_row(&pass, disparity_q4 + (y + 1 - block + block / 2) * out_stride);
    }
    for (y = left->height - block + 1 + block / 2; y < left->height; y++)
        fill_row(disparity_q4 + y * out_stride, pass.width);
    return DENSE_OK;
}

void dense_planes(const uint8_t *rgb, uint32_t count, dense_color_t color,
                  uint8_t *const planes[DENSE_MAX_PLANES])
{
    uint32_t i;

    for (i = 0; i < count; i++, rgb += 3) {
        hsv_t hsv;

        switch (color) {
        case DENSE_HSV:
            hsv = color_hsv(rgb[0], rgb[1], rgb[2]);
            planes[0][i] = hsv.hue;
            planes[1][i] = hsv.saturation;
            planes[2][i] = hsv.value;
            break;
        case DENSE_RGB:
            planes[0][i] = rgb[0];
            planes[1][i] = rgb[1];
            planes[2][i] = rgb[2];
            break;
        case DENSE_GREY:
        default:
            planes[0][i] = color_grey(rgb[0], rgb[1], rgb[2]);
            break;
        }
    }
}
