#include "vision/dense_bm.h"

#include "vision/dense_filter.h"
#include "vision/multiversion.h"

/* The map is computed in upright strips, so that what a strip needs for all disparities, sums of
 * columns and of blocks in a row, stays near the processor. Loops run along x over the whole strip,
 * STRIP results or the COLUMNS that their blocks cover: constants, so that the compiler unrolls
 * them. What they compute beyond the picture is never looked at. */
#define STRIP   128u
#define COLUMNS (STRIP + 32u)

/* Columns beyond the picture that strips touch: blocks reach 10 px to the left of the first column,
 * the last strip may have only one result. */
#define PAD_LEFT  16u
#define PAD_RIGHT COLUMNS

/* All sums carry this offset, so that signed 16-bit comparisons, which every vector unit has, order
 * sums up to 2 * 63 * 21 * 21 = 55,566. It needs no instruction: column sums start with it, and an
 * odd number of them has it again, modulo 2^16. */
#define BIAS 0x8000u

/* More than any sum, without bias. */
#define NO_SUM UINT16_MAX

/* Rows are longer than what is used: sums of three read 8 columns further, and a number of cache
 * lines that is no power of two keeps the rows of all disparities from competing for the same
 * places in the cache. */
#define CACHE_LINE 64u
typedef uint16_t column_row_t[COLUMNS + 32u];
typedef uint16_t block_row_t[STRIP + 32u];

/* What is found along one row of a strip. */
typedef struct {
    int16_t lowest[STRIP];  /* block sum, with bias */
    int16_t limit[STRIP];   /* what a rival must exceed, with bias */
    uint16_t at[STRIP];     /* disparity of the lowest */
    uint16_t rivals[STRIP]; /* how many sums do not exceed the limit, itself included */
    uint16_t before[STRIP]; /* sums at the disparity - 1 and + 1, without bias */
    uint16_t after[STRIP];
} findings_t;

typedef struct {
    const bm_params_t *params;
    uint32_t width;
    uint32_t height;
    uint32_t plane_stride;
    uint8_t *gradient[2];  /* pre-filtered eyes; pixel (0, 0) */
    uint8_t *blank;        /* a row without gradient; pixel 0 */
    column_row_t *columns; /* [disparities + 1]: sums of columns; the last is texture */
    block_row_t *blocks;   /* [disparities + 1]: sums of blocks, likewise */
    findings_t *found;     /* of the row at work */
    uint16_t *margins;     /* [disparities][margin]: see take_margins */
    uint16_t *costs;       /* for the left-right check: the smallest sum of each pixel */
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
} bm_t;

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

static uint32_t plane_stride(uint32_t width)
{
    return PAD_LEFT + width + PAD_RIGHT;
}

uint32_t bm_work_words(uint16_t width, uint16_t height, const bm_params_t *params)
{
    uint32_t bytes;

    if (!params_fit(params) || width == 0 || width > DENSE_MAX_SIDE || height == 0 ||
        height > DENSE_MAX_SIDE)
        return 0;
    bytes = plane_stride(width) * (2u * height + 1u);
    bytes += (uint32_t)(sizeof(column_row_t) + sizeof(block_row_t)) * (params->disparities + 1u);
    bytes += (uint32_t)sizeof(findings_t);
    if (params->left_right_max >= 0) {
        bytes += 2u * params->disparities * (params->block / 2u);
        bytes += 2u * width * height;
        bytes += 4u * DENSE_LEFT_RIGHT_WORDS(width);
    }
    return (bytes + CACHE_LINE) / 4u + 1u;
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
                                 const uint8_t *restrict right_out, uint16_t *restrict columns)
{
    uint32_t x;

    for (x = 0; x < COLUMNS; x++) {
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
                  uint32_t disparities, column_row_t *columns)
{
    uint32_t d;

    for (d = 0; d < disparities; d++)
        slide_columns(in[0], in[1] - d, out[0], out[1] - d, columns[d]);
    slide_columns(in[0], blank, out[0], blank, columns[d]);
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

static inline void add_three(const uint16_t *a, const uint16_t *b, const uint16_t *c, uint32_t n,
                             uint16_t *restrict sums)
{
    uint32_t x;

    for (x = 0; x < n; x++)
        sums[x] = (uint16_t)(a[x] + b[x] + c[x]);
}

/* The last of the three additions, which also keeps the lowest block sum of each place. */
static inline void add_last_three(const uint16_t *a, const uint16_t *b, const uint16_t *c,
                                  uint16_t *restrict sums, int16_t *restrict lowest)
{
    uint32_t x;

    for (x = 0; x < STRIP; x++) {
        uint16_t sum = (uint16_t)(a[x] + b[x] + c[x]);

        sums[x] = sum;
        lowest[x] = (int16_t)sum < lowest[x] ? (int16_t)sum : lowest[x];
    }
}

/* Block sums of all disparities, and their minimum; behind them those of texture. */
MULTIVERSION
static void sum_blocks(const column_row_t *columns, uint32_t block, uint32_t disparities,
                       block_row_t *blocks, int16_t *restrict lowest)
{
    column_row_t threes = {0};
    column_row_t many = {0};
    int16_t no_matter[STRIP] = {0};
    const term_t *terms = block_terms[(block - BM_MIN_BLOCK) / 2];
    uint32_t d;
    uint32_t i;

    for (i = 0; i < STRIP; i++)
        lowest[i] = INT16_MAX;
    for (d = 0; d <= disparities; d++) {
        const uint16_t *ones = columns[d];
        const uint16_t *kinds[] = {ones, threes, many};
        const uint16_t *term[3];

        for (i = 0; i < 3; i++)
            term[i] = kinds[terms[i].kind] + terms[i].offset;
        add_three(ones, ones + 1, ones + 2, COLUMNS, threes);
        if (block >= FIRST_BLOCK_OF_MANY)
            add_three(threes, threes + 3, block == BLOCK_OF_SEVENS ? ones + 6 : threes + 6, COLUMNS,
                      many);
        add_last_three(term[0], term[1], term[2], blocks[d], d < disparities ? lowest : no_matter);
    }
}

/* The limit of uniqueness: lowest + lowest * percent / 100, cut to 16 bits. */
MULTIVERSION
static void set_limits(uint32_t percent, const int16_t *restrict lowest, int16_t *restrict limits)
{
    uint32_t x;

    for (x = 0; x < STRIP; x++) {
        uint32_t sum = (uint16_t)((uint16_t)lowest[x] ^ BIAS);
        uint32_t limit = sum + sum * percent / 100u;

        limits[x] = (int16_t)(uint16_t)((limit < NO_SUM ? limit : NO_SUM - 1u) ^ BIAS);
    }
}

/* Where the lowest sum is, ties to the larger disparity, and how many sums do not exceed the limit.
 * It is the outer loop that becomes vectors, with the inner one's state in registers; for that the
 * inner one must be known to run at least once. */
MULTIVERSION
static void find_rivals(const block_row_t *restrict blocks, uint32_t disparities,
                        const int16_t *restrict lowest, const int16_t *restrict limit,
                        uint16_t *restrict at, uint16_t *restrict rivals)
{
    uint32_t x;
    uint32_t d;

    for (x = 0; x < STRIP; x++) {
        int16_t least = lowest[x];
        int16_t most = limit[x];
        uint16_t here = 0;
        uint16_t place = 0;
        uint16_t count = 0;

        d = 0;
        do {
            int16_t sum = (int16_t)blocks[d][x];

            place = sum == least ? here : place;
            count = (uint16_t)(count + (sum <= most));
            here++;
        } while (++d < disparities);
        at[x] = place;
        rivals[x] = count;
    }
}

/* Sums beside the lowest; beyond the ends of the search NO_SUM. */
static void find_neighbours(const block_row_t *blocks, uint32_t disparities, findings_t *found)
{
    uint32_t x;

    for (x = 0; x < STRIP; x++) {
        uint32_t d = found->at[x];

        found->before[x] = d > 0 ? (uint16_t)(blocks[d - 1][x] ^ BIAS) : NO_SUM;
        found->after[x] = d + 1 < disparities ? (uint16_t)(blocks[d + 1][x] ^ BIAS) : NO_SUM;
    }
}

/* quotients = 128 * parts / wholes, rounded down, for part <= whole; 0 / 0 is 0. Long division: it
 * needs no divider and no more than 16 bits. Overwrites the parts. */
MULTIVERSION
static void divide(uint16_t *restrict parts, const uint16_t *restrict wholes,
                   uint16_t *restrict quotients)
{
    uint32_t x;
    int bit;

    for (x = 0; x < STRIP; x++) {
        uint16_t fits = (parts[x] >= wholes[x]) & (wholes[x] > 0);

        parts[x] = (uint16_t)(fits ? 0 : parts[x]);
        quotients[x] = fits;
    }
    for (bit = 0; bit < 7; bit++) {
        for (x = 0; x < STRIP; x++) {
            /* 2 * part >= whole, without overflow */
            uint16_t to_whole = (uint16_t)(wholes[x] - parts[x]);
            uint16_t fits = (parts[x] >= to_whole) & (wholes[x] > 0);

            parts[x] = (uint16_t)(fits ? parts[x] - to_whole : parts[x] + parts[x]);
            quotients[x] = (uint16_t)(2 * quotients[x] + fits);
        }
    }
}

/* Where between the pixels the lowest sum is: two lines of equal steepness through the sums at -1,
 * 0, +1 meet there. In 1/256 px, positive or negative; 0 at the ends of the search. */
MULTIVERSION
static void refine(const findings_t *found, int16_t *restrict steps)
{
    uint16_t parts[STRIP];
    uint16_t wholes[STRIP];
    uint16_t quotients[STRIP];
    uint32_t x;

    for (x = 0; x < STRIP; x++) {
        uint16_t before = found->before[x];
        uint16_t after = found->after[x];
        uint16_t higher = before > after ? before : after;
        uint16_t lower = before > after ? after : before;
        uint16_t whole = (uint16_t)(higher - ((uint16_t)found->lowest[x] ^ BIAS));

        parts[x] = (uint16_t)(higher - lower);
        wholes[x] = higher == NO_SUM ? 0 : whole;
    }
    divide(parts, wholes, quotients);
    for (x = 0; x < STRIP; x++)
        steps[x] = (int16_t)(found->before[x] > found->after[x] ? quotients[x] : -quotients[x]);
}

/* Disparities of a row: none where texture is missing or another place is as good. */
MULTIVERSION
static void finish_row(const bm_params_t *params, const findings_t *found,
                       const int16_t *restrict steps, const uint16_t *restrict texture_sums,
                       int16_t *restrict out)
{
    uint16_t texture_min = params->texture_min;
    uint16_t no_check = params->uniqueness_percent == 0;
    uint32_t x;

    for (x = 0; x < STRIP; x++) {
        uint16_t limit = (uint16_t)((uint16_t)found->limit[x] ^ BIAS);
        uint16_t texture = (uint16_t)(texture_sums[x] ^ BIAS);
        uint16_t own = (uint16_t)(1 + (found->before[x] <= limit) + (found->after[x] <= limit));
        uint16_t unique = (uint16_t)(no_check | (found->rivals[x] == own));
        /* (256 at + step + 15) >> 4, with no negative number shifted */
        uint16_t step = (uint16_t)(((uint16_t)(steps[x] + 15 + 128) >> 4) - 8);
        uint16_t disparity = (uint16_t)(16 * found->at[x] + step);

        disparity = texture < texture_min ? (uint16_t)DENSE_INVALID_Q4 : disparity;
        out[x] = (int16_t)(unique ? disparity : (uint16_t)DENSE_INVALID_Q4);
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
        uint16_t *columns = bm->columns[d];
        uint16_t *margin = bm->margins + d * bm->margin;

        for (c = 0; bm->start == 0 && c < bm->margin; c++) {
            int change_in = (int)in[0][c] - in[1][(int32_t)(bm->margin - d)];
            int change_out = (int)out[0][c] - out[1][(int32_t)(bm->margin - d)];

            margin[c] = (uint16_t)(margin[c] + (change_in < 0 ? -change_in : change_in) -
                                   (change_out < 0 ? -change_out : change_out));
            columns[c] = margin[c];
        }
        for (c = last + 1; c >= bm->start && c < bm->start + COLUMNS; c++)
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
    slide(in, out, bm->blank + column, bm->params->disparities, bm->columns);
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
    const block_row_t *blocks = (const block_row_t *)bm->blocks;
    findings_t *found = bm->found;
    int16_t steps[STRIP];
    int16_t row[STRIP];

    sum_blocks((const column_row_t *)bm->columns, params->block, params->disparities, bm->blocks,
               found->lowest);
    set_limits(params->uniqueness_percent, found->lowest, found->limit);
    find_rivals(blocks, params->disparities, found->lowest, found->limit, found->at, found->rivals);
    find_neighbours(blocks, params->disparities, found);
    refine(found, steps);
    finish_row(params, found, steps, blocks[params->disparities], row);
    copy_row(bm, y, found, row);
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

    fill_sums(bm->columns[0],
              (bm->params->disparities + 1u) * (uint32_t)(sizeof(column_row_t) / sizeof(uint16_t)));
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
    for (bm->start = 0; bm->start < bm->results; bm->start += STRIP) {
        bm->length = bm->results - bm->start < STRIP ? bm->results - bm->start : STRIP;
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

/* Lay out the work memory: words first, then what has 16 bits, then bytes. Returns where the words
 * for the left-right check are. */
static uint32_t *share_out(bm_t *bm, uint32_t *work)
{
    const bm_params_t *params = bm->params;
    uint32_t *rest = work + (bm->margin ? DENSE_LEFT_RIGHT_WORDS(bm->width) : 0);
    uint32_t beyond_line = (uint32_t)((uintptr_t)rest % CACHE_LINE);
    uint16_t *halves = (uint16_t *)(rest + (CACHE_LINE - beyond_line) / sizeof *rest);
    uint8_t *bytes;

    bm->columns = (column_row_t *)halves;
    bm->blocks = (block_row_t *)(bm->columns + params->disparities + 1u);
    bm->found = (findings_t *)(bm->blocks + params->disparities + 1u);
    halves = (uint16_t *)(bm->found + 1);
    if (bm->margin) {
        bm->margins = halves;
        bm->costs = bm->margins + params->disparities * bm->margin;
        halves = bm->costs + bm->width * bm->height;
    }
    bytes = (uint8_t *)halves + PAD_LEFT;
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
