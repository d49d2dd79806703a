#include "vision/dense_bm.h"

#include "vision/dense_filter.h"
#include "vision/multiversion.h"

/* The map is computed in upright strips, so that what a strip needs for all disparities stays in
 * the processor's first cache: of each row the column sums and the block sums. Loops run along x,
 * over a number of pixels that is a multiple of LANES. */
#define LANES       16u
#define STRIP_MAX   128u
#define COLUMNS_MAX (STRIP_MAX + 2u * LANES)

/* Columns beyond the picture that strips may touch: blocks reach 10 px to the left of the first
 * column, strips are rounded up to the right. */
#define PAD_LEFT  16u
#define PAD_RIGHT (4u * LANES)

/* All sums carry this offset, so that signed 16-bit comparisons, which every vector unit has, order
 * sums up to 2 * 63 * 21 * 21 = 55,566. It needs no instruction: column sums start with it, and an
 * odd number of them has it again, modulo 2^16. */
#define BIAS 0x8000u

/* More than any sum, without bias. */
#define NO_SUM UINT16_MAX

typedef struct {
    const bm_params_t *params;
    uint32_t width;
    uint32_t height;
    uint32_t plane_stride;
    uint8_t *gradient[2]; /* pre-filtered eyes; pixel (0, 0) */
    uint8_t *blank;       /* a row without gradient; pixel 0 */
    uint16_t *columns; /* [disparities + 1][column_stride] sums of columns; the last is texture */
    uint16_t *blocks;  /* [disparities][block_stride] sums of blocks */
    uint16_t *margins; /* [disparities][block - 1]: see take_margins */
    uint16_t *costs;   /* for the left-right check: the smallest sum of each pixel */
    int16_t *map;
    uint32_t map_stride;
    /* Columns and results of all strips: without the left-right check the pixels that can have a
     * disparity, with it all for which a search is defined. */
    uint32_t margin;
    uint32_t first_column;
    uint32_t first_x;
    uint32_t results;
    /* The strip at work. */
    uint32_t start; /* its first result, counted from first_x */
    uint32_t length;
    uint32_t column_stride;
    uint32_t block_stride;
} bm_t;

/* What is found along one row of a strip. */
typedef struct {
    int16_t lowest[STRIP_MAX];   /* block sum, with bias */
    int16_t limit[STRIP_MAX];    /* what a rival must exceed, with bias */
    uint16_t at[STRIP_MAX];      /* disparity of the lowest */
    uint16_t rivals[STRIP_MAX];  /* how many sums do not exceed the limit, itself included */
    uint16_t texture[STRIP_MAX]; /* with bias */
    uint16_t before[STRIP_MAX];  /* sums at the disparity - 1 and + 1, without bias */
    uint16_t after[STRIP_MAX];
} findings_t;

bm_params_t bm_defaults(uint8_t block, uint16_t disparities)
{
    bm_params_t params = {block, disparities, 31, 15, 10, BM_NO_LEFT_RIGHT};

    return params;
}

static int params_fit(const bm_params_t *p)
{
    return p->block >= BM_MIN_BLOCK && p->block <= BM_MAX_BLOCK && p->block % 2 == 1 &&
           p->disparities >= BM_DISPARITY_STEP && p->disparities <= DENSE_MAX_DISPARITIES &&
           p->disparities % BM_DISPARITY_STEP == 0 && p->prefilter_cap >= 1 &&
           p->prefilter_cap <= BM_MAX_PREFILTER_CAP && p->uniqueness_percent <= BM_MAX_UNIQUENESS;
}

static uint32_t round_up(uint32_t n, uint32_t unit)
{
    return (n + unit - 1) / unit * unit;
}

static uint32_t plane_stride(uint32_t width)
{
    return round_up(PAD_LEFT + width + PAD_RIGHT, LANES);
}

uint32_t bm_work_words(uint16_t width, uint16_t height, const bm_params_t *params)
{
    uint32_t bytes;

    if (!params_fit(params) || width == 0 || width > DENSE_MAX_SIDE || height == 0 ||
        height > DENSE_MAX_SIDE)
        return 0;
    bytes = plane_stride(width) * (2u * height + 1u);
    bytes += 2u * COLUMNS_MAX * (params->disparities + 1u);
    bytes += 2u * STRIP_MAX * params->disparities;
    if (params->left_right_max >= 0) {
        bytes += 2u * params->disparities * (params->block - 1u);
        bytes += 2u * width * height;
        bytes += 4u * DENSE_LEFT_RIGHT_WORDS(width);
    }
    return bytes / 4u + 1u;
}

/* One row of the pre-filter: 1-2-1 down, right minus left across, cut and lifted to 0..2 cap. */
MULTIVERSION
static void gradient_row(const uint8_t *above, const uint8_t *row, const uint8_t *below,
                         uint32_t width, int16_t cap, uint8_t *out)
{
    uint32_t x;

    for (x = 1; x + 1 < width; x++) {
        int16_t rise = (int16_t)(above[x + 1] - above[x - 1] + 2 * (row[x + 1] - row[x - 1]) +
                                 below[x + 1] - below[x - 1]);

        rise = rise < -cap ? (int16_t)-cap : rise;
        rise = rise > cap ? cap : rise;
        out[x] = (uint8_t)(rise + cap);
    }
    out[0] = (uint8_t)cap;
    out[width - 1] = (uint8_t)cap;
}

static void fill_bytes(uint8_t *out, uint32_t count, uint8_t value)
{
    uint32_t i;

    for (i = 0; i < count; i++)
        out[i] = value;
}

static void prefilter(const bm_t *bm, const dense_eye_t *eye, uint8_t *out)
{
    uint32_t y;

    for (y = 0; y < bm->height; y++) {
        const uint8_t *row = eye->planes[0] + y * eye->stride;
        const uint8_t *above = y ? row - eye->stride : row + eye->stride;
        const uint8_t *below = y + 1 < bm->height ? row + eye->stride : row - eye->stride;
        uint8_t *line = out + y * bm->plane_stride;

        fill_bytes(line - PAD_LEFT, bm->plane_stride, bm->params->prefilter_cap);
        /* OpenCV takes rows in pairs and leaves the last of an odd number without gradient. */
        if (y + 1 < bm->height || y % 2 == 1)
            gradient_row(above, row, below, bm->width, bm->params->prefilter_cap, line);
    }
}

/* columns[x] += |left - right| of the row that enters the window - that of the row that leaves it.
 * A difference is at most 126, so the change fits 8 bits. */
static inline void slide_columns(const uint8_t *restrict left_in, const uint8_t *restrict right_in,
                                 const uint8_t *restrict left_out,
                                 const uint8_t *restrict right_out, uint32_t n,
                                 uint16_t *restrict columns)
{
    uint32_t x;

    for (x = 0; x < n; x++) {
        uint8_t high_in = left_in[x] > right_in[x] ? left_in[x] : right_in[x];
        uint8_t low_in = left_in[x] > right_in[x] ? right_in[x] : left_in[x];
        uint8_t high_out = left_out[x] > right_out[x] ? left_out[x] : right_out[x];
        uint8_t low_out = left_out[x] > right_out[x] ? right_out[x] : left_out[x];
        int8_t change = (int8_t)(uint8_t)((high_in - low_in) - (high_out - low_out));

        columns[x] = (uint16_t)(columns[x] + change);
    }
}

/* Let the row `in` enter and the row `out` leave, for all disparities and for texture. Pointers are
 * to the pixels of the strip's first column. */
MULTIVERSION
static void slide(const uint8_t *const in[2], const uint8_t *const out[2], const uint8_t *blank,
                  uint32_t disparities, uint32_t n, uint16_t *columns)
{
    uint32_t d;

    for (d = 0; d < disparities; d++)
        slide_columns(in[0], in[1] - d, out[0], out[1] - d, n, columns + d * n);
    slide_columns(in[0], blank, out[0], blank, n, columns + d * n);
}

/* A block's columns are added up as three terms, each of them one column, the sum of three columns,
 * or that of nine (of seven, for 17). */
typedef struct {
    enum { ONE, THREE, MANY } kind;
    uint32_t offset;
} term_t;

static const term_t block_terms[][3] = {
    /*  5 */ {{THREE, 0}, {ONE, 3}, {ONE, 4}},
    /*  7 */ {{THREE, 0}, {THREE, 3}, {ONE, 6}},
    /*  9 */ {{THREE, 0}, {THREE, 3}, {THREE, 6}},
    /* 11 */ {{MANY, 0}, {ONE, 9}, {ONE, 10}},
    /* 13 */ {{MANY, 0}, {THREE, 9}, {ONE, 12}},
    /* 15 */ {{MANY, 0}, {THREE, 9}, {THREE, 12}},
    /* 17 */ {{MANY, 0}, {MANY, 7}, {THREE, 14}},
    /* 19 */ {{MANY, 0}, {MANY, 9}, {ONE, 18}},
    /* 21 */ {{MANY, 0}, {MANY, 9}, {THREE, 18}},
};
#define FIRST_BLOCK_OF_MANY 11u
#define BLOCK_OF_SEVENS     17u

static inline void add_three(const uint16_t *restrict a, const uint16_t *restrict b,
                             const uint16_t *restrict c, uint32_t n, uint16_t *restrict sums)
{
    uint32_t x;

    for (x = 0; x < n; x++)
        sums[x] = (uint16_t)(a[x] + b[x] + c[x]);
}

/* Sums of `block` columns at n places. `columns` has 2 * LANES more than n. */
static inline void add_columns(const uint16_t *columns, uint32_t n, uint32_t block,
                               uint16_t *restrict sums)
{
    uint16_t threes[COLUMNS_MAX];
    uint16_t many[COLUMNS_MAX];
    const term_t *terms = block_terms[(block - BM_MIN_BLOCK) / 2];
    const uint16_t *kinds[3];

    kinds[ONE] = columns;
    kinds[THREE] = threes;
    kinds[MANY] = many;
    add_three(columns, columns + 1, columns + 2, n + block - 3, threes);
    if (block >= FIRST_BLOCK_OF_MANY)
        add_three(threes, threes + 3, block == BLOCK_OF_SEVENS ? columns + 6 : threes + 6,
                  n + block - 9, many);
    add_three(kinds[terms[0].kind] + terms[0].offset, kinds[terms[1].kind] + terms[1].offset,
              kinds[terms[2].kind] + terms[2].offset, n, sums);
}

/* Block sums of all disparities, and their minimum. n is a multiple of LANES. */
MULTIVERSION
static void sum_blocks(const uint16_t *columns, uint32_t column_stride, uint32_t n, uint32_t block,
                       uint32_t disparities, uint16_t *restrict blocks, findings_t *restrict found)
{
    uint32_t d;
    uint32_t x;

    for (x = 0; x < n; x++)
        found->lowest[x] = INT16_MAX;
    for (d = 0; d < disparities; d++) {
        add_columns(columns + d * column_stride, n, block, blocks + d * n);
        for (x = 0; x < n; x++) {
            int16_t sum = (int16_t)blocks[d * n + x];

            found->lowest[x] = sum < found->lowest[x] ? sum : found->lowest[x];
        }
    }
    add_columns(columns + disparities * column_stride, n, block, found->texture);
}

/* The limit of uniqueness: lowest + lowest * percent / 100, cut to 16 bits. */
MULTIVERSION
static void set_limits(uint32_t n, uint32_t percent, findings_t *found)
{
    uint32_t x;

    for (x = 0; x < n; x++) {
        uint32_t lowest = (uint16_t)((uint16_t)found->lowest[x] ^ BIAS);
        uint32_t limit = lowest + lowest * percent / 100u;

        found->limit[x] = (int16_t)(uint16_t)((limit < NO_SUM ? limit : NO_SUM - 1u) ^ BIAS);
    }
}

/* Where the lowest sum is, ties to the larger disparity, and how many sums do not exceed the limit.
 * LANES results at a time, whose state stays in registers. */
MULTIVERSION
static void find_lowest(const uint16_t *restrict blocks, uint32_t n, uint32_t disparities,
                        findings_t *restrict found)
{
    uint32_t first;
    uint32_t d;
    uint32_t i;

    for (first = 0; first < n; first += LANES) {
        int16_t lowest[LANES];
        int16_t limit[LANES];
        uint16_t at[LANES];
        uint16_t rivals[LANES];

        for (i = 0; i < LANES; i++) {
            lowest[i] = found->lowest[first + i];
            limit[i] = found->limit[first + i];
            at[i] = 0;
            rivals[i] = 0;
        }
        for (d = 0; d < disparities; d++) {
            const uint16_t *sums = blocks + d * n + first;

            for (i = 0; i < LANES; i++) {
                int16_t sum = (int16_t)sums[i];

                at[i] = sum == lowest[i] ? (uint16_t)d : at[i];
                rivals[i] = (uint16_t)(rivals[i] + (sum <= limit[i]));
            }
        }
        for (i = 0; i < LANES; i++) {
            found->at[first + i] = at[i];
            found->rivals[first + i] = rivals[i];
        }
    }
}

/* Sums beside the lowest; beyond the ends of the search NO_SUM. */
static void find_neighbours(const uint16_t *blocks, uint32_t n, uint32_t disparities,
                            findings_t *found)
{
    uint32_t x;

    for (x = 0; x < n; x++) {
        uint32_t d = found->at[x];
        const uint16_t *sum = blocks + d * n + x;

        found->before[x] = d > 0 ? (uint16_t)(*(sum - n) ^ BIAS) : NO_SUM;
        found->after[x] = d + 1 < disparities ? (uint16_t)(*(sum + n) ^ BIAS) : NO_SUM;
    }
}

/* 128 * part / whole, rounded down, for part <= whole: long division, which needs no divider and no
 * more than 16 bits. 0 / 0 is 0. */
static inline uint16_t hundred_twenty_eighths(uint16_t part, uint16_t whole)
{
    uint16_t fits = part >= whole;
    uint16_t rest = (uint16_t)(part - (fits ? whole : 0));
    uint16_t quotient = fits;
    int bit;

    for (bit = 0; bit < 7; bit++) {
        /* 2 * rest >= whole, without overflow */
        uint16_t to_whole = (uint16_t)(whole - rest);

        fits = rest >= to_whole;
        rest = (uint16_t)(rest + (fits ? -to_whole : rest));
        quotient = (uint16_t)(2 * quotient + fits);
    }
    return whole ? quotient : 0;
}

/* Disparities of n results: refined between pixels by two lines of equal steepness through the sums
 * at -1, 0, +1; none where texture is missing or another place is as good. */
MULTIVERSION
static void finish_row(const bm_params_t *params, uint32_t n, const findings_t *found,
                       int16_t *restrict out)
{
    uint16_t texture_min = params->texture_min;
    uint16_t check_rivals = params->uniqueness_percent > 0;
    uint32_t x;

    for (x = 0; x < n; x++) {
        uint16_t before = found->before[x];
        uint16_t after = found->after[x];
        uint16_t higher = before > after ? before : after;
        uint16_t lower = before > after ? after : before;
        uint16_t lowest = (uint16_t)((uint16_t)found->lowest[x] ^ BIAS);
        uint16_t limit = (uint16_t)((uint16_t)found->limit[x] ^ BIAS);
        uint16_t texture = (uint16_t)(found->texture[x] ^ BIAS);
        uint16_t own = (uint16_t)(1 + (before <= limit) + (after <= limit));
        int16_t step = (int16_t)hundred_twenty_eighths((uint16_t)(higher - lower),
                                                       (uint16_t)(higher - lowest));
        uint16_t valid = (texture >= texture_min) & (!check_rivals | (found->rivals[x] == own));

        step = before > after ? step : (int16_t)-step;
        step = higher == NO_SUM ? 0 : step; /* an end of the search: one side is unknown */
        /* (256 at + step + 15) >> 4, with no negative number shifted */
        step = (int16_t)(((step + 15 + 128) >> 4) - 8);
        out[x] = valid ? (int16_t)(16 * found->at[x] + step) : (int16_t)DENSE_INVALID_Q4;
    }
}

/* With the left-right check OpenCV also takes blocks that reach out of what can be searched, and
 * their disparities have a say. Columns left of the first that has all its partners compare with
 * the partners of that first; those right of the picture repeat its last column. */
static void take_margins(const bm_t *bm, const uint8_t *const in[2], const uint8_t *const out[2])
{
    uint32_t last = bm->margin + (bm->width - bm->params->disparities);
    uint32_t d;
    uint32_t c;

    for (d = 0; d < bm->params->disparities; d++) {
        uint16_t *columns = bm->columns + d * bm->column_stride;
        uint16_t *margin = bm->margins + d * bm->margin;

        for (c = 0; bm->start == 0 && c < bm->margin; c++) {
            int change_in = (int)in[0][c] - in[1][(int32_t)(bm->margin - d)];
            int change_out = (int)out[0][c] - out[1][(int32_t)(bm->margin - d)];

            margin[c] = (uint16_t)(margin[c] + (change_in < 0 ? -change_in : change_in) -
                                   (change_out < 0 ? -change_out : change_out));
            columns[c] = margin[c];
        }
        for (c = last + 1; c >= bm->start && c < bm->start + bm->column_stride; c++)
            columns[c - bm->start] = columns[last - bm->start];
    }
}

static void slide_strip(const bm_t *bm, uint32_t y)
{
    int32_t column = (int32_t)(bm->first_column + bm->start);
    uint32_t block = bm->params->block;
    const uint8_t *in[2];
    const uint8_t *out[2];
    int eye;

    for (eye = 0; eye < 2; eye++) {
        in[eye] = bm->gradient[eye] + y * bm->plane_stride + column;
        out[eye] = y < block ? bm->blank + column
                             : bm->gradient[eye] + (y - block) * bm->plane_stride + column;
    }
    slide(in, out, bm->blank + column, bm->params->disparities, bm->column_stride, bm->columns);
    if (bm->margin)
        take_margins(bm, in, out);
}

static void copy_row(const bm_t *bm, uint32_t y, const findings_t *found, const int16_t *row)
{
    uint32_t first = bm->first_x + bm->start;
    uint32_t x;

    for (x = 0; x < bm->length; x++)
        bm->map[y * bm->map_stride + first + x] = row[x];
    for (x = 0; bm->margin && x < bm->length; x++)
        bm->costs[y * bm->width + first + x] = (uint16_t)((uint16_t)found->lowest[x] ^ BIAS);
}

static void search_strip_row(const bm_t *bm, uint32_t y)
{
    const bm_params_t *params = bm->params;
    uint32_t n = bm->block_stride;
    findings_t found;
    int16_t row[STRIP_MAX];

    sum_blocks(bm->columns, bm->column_stride, n, params->block, params->disparities, bm->blocks,
               &found);
    set_limits(n, params->uniqueness_percent, &found);
    find_lowest(bm->blocks, n, params->disparities, &found);
    find_neighbours(bm->blocks, n, params->disparities, &found);
    finish_row(params, n, &found, row);
    copy_row(bm, y, &found, row);
}

static void fill_sums(uint16_t *sums, uint32_t count)
{
    uint32_t i;

    for (i = 0; i < count; i++)
        sums[i] = BIAS;
}

static void search_strip(const bm_t *bm)
{
    uint32_t block = bm->params->block;
    uint32_t y;

    fill_sums(bm->columns, bm->column_stride * (bm->params->disparities + 1u));
    if (bm->margin)
        fill_sums(bm->margins, bm->margin * bm->params->disparities);
    for (y = 0; y < bm->height; y++) {
        slide_strip(bm, y);
        if (y + 1 >= block)
            search_strip_row(bm, y - block / 2);
    }
}

static void search(bm_t *bm)
{
    uint32_t strips = (bm->results + STRIP_MAX - 1) / STRIP_MAX;
    uint32_t share = round_up((bm->results + strips - 1) / strips, LANES);

    bm->block_stride = share;
    bm->column_stride = round_up(share + bm->params->block - 1u, LANES);
    for (bm->start = 0; bm->start < bm->results; bm->start += share) {
        bm->length = bm->results - bm->start < share ? bm->results - bm->start : share;
        search_strip(bm);
    }
}

static void fill_invalid(const bm_t *bm, uint32_t y, uint32_t from, uint32_t to)
{
    uint32_t x;

    for (x = from; x < to; x++)
        bm->map[y * bm->map_stride + x] = DENSE_INVALID_Q4;
}

/* Check all rows, then forget the pixels that only had a say. */
static void check_left_right(const bm_t *bm, uint32_t *work)
{
    uint32_t half = bm->params->block / 2u;
    uint32_t y;

    for (y = half; y + half < bm->height; y++) {
        dense_left_right_row(bm->map + y * bm->map_stride, bm->costs + y * bm->width,
                             (uint16_t)bm->width, bm->params->disparities,
                             (uint16_t)bm->params->left_right_max, work);
        fill_invalid(bm, y, 0, bm->params->disparities - 1u + half);
        fill_invalid(bm, y, bm->width - half, bm->width);
    }
}

/* Lay out the work memory; what is left over at its end is for the left-right check. */
static uint32_t *share_out(bm_t *bm, uint32_t *work)
{
    const bm_params_t *params = bm->params;
    uint8_t *bytes;
    uint32_t *rest = work;

    if (bm->margin) {
        rest += DENSE_LEFT_RIGHT_WORDS(bm->width);
        bm->costs = (uint16_t *)rest;
        bm->margins = bm->costs + bm->width * bm->height;
        bm->columns = bm->margins + params->disparities * (params->block - 1u);
    } else {
        bm->columns = (uint16_t *)rest;
    }
    bm->blocks = bm->columns + COLUMNS_MAX * (params->disparities + 1u);
    bytes = (uint8_t *)(bm->blocks + STRIP_MAX * params->disparities) + PAD_LEFT;
    bm->gradient[0] = bytes;
    bm->gradient[1] = bytes + bm->plane_stride * bm->height;
    bm->blank = bytes + 2u * bm->plane_stride * bm->height;
    return work;
}

static dense_error_t check(const dense_eye_t *left, const dense_eye_t *right,
                           const bm_params_t *params, uint32_t work_words, uint16_t out_stride)
{
    uint32_t needed = bm_work_words(left->width, left->height, params);

    if (needed == 0 || left->width != right->width || left->height != right->height ||
        left->stride < left->width || right->stride < right->width || out_stride < left->width)
        return DENSE_BAD_PARAM;
    if (left->width <= params->block || left->height <= params->block)
        return DENSE_TOO_SMALL;
    if (work_words < needed)
        return DENSE_NO_MEMORY;
    return DENSE_OK;
}

/* Which pixels are searched; 0 if none. */
static int lay_out(bm_t *bm)
{
    uint32_t half = bm->params->block / 2u;
    uint32_t first = bm->params->disparities - 1u;

    if (bm->width < bm->params->disparities + 2u * half)
        return 0;
    bm->margin = bm->params->left_right_max >= 0 ? half : 0;
    bm->first_column = first - bm->margin;
    bm->first_x = bm->first_column + half;
    bm->results = bm->width - first - 2u * (half - bm->margin);
    return 1;
}

dense_error_t bm_map(const dense_eye_t *left, const dense_eye_t *right, const bm_params_t *params,
                     uint32_t *work, uint32_t work_words, int16_t *disparity_q4,
                     uint16_t out_stride)
{
    dense_error_t error = check(left, right, params, work_words, out_stride);
    bm_t bm = {0};
    uint32_t y;

    if (error != DENSE_OK)
        return error;
    bm.params = params;
    bm.width = left->width;
    bm.height = left->height;
    bm.plane_stride = plane_stride(left->width);
    bm.map = disparity_q4;
    bm.map_stride = out_stride;
    for (y = 0; y < bm.height; y++)
        fill_invalid(&bm, y, 0, bm.width);
    if (!lay_out(&bm))
        return DENSE_OK;
    work = share_out(&bm, work);
    prefilter(&bm, left, bm.gradient[0]);
    prefilter(&bm, right, bm.gradient[1]);
    fill_bytes(bm.blank - PAD_LEFT, bm.plane_stride, params->prefilter_cap);
    search(&bm);
    if (bm.margin)
        check_left_right(&bm, work);
    return DENSE_OK;
}
