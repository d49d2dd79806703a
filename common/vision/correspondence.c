#include "vision/correspondence.h"

static int higher_is_better(match_method_t method)
{
    return method == MATCH_CORR || method == MATCH_NCC;
}

static int is_better(match_method_t method, uint32_t a, uint32_t b)
{
    return higher_is_better(method) ? a > b : a < b;
}

static uint32_t worst_cost(match_method_t method)
{
    return higher_is_better(method) ? 0 : UINT32_MAX;
}

static const uint8_t *block_corner(const image_view_t *view, int x, int y, int width, int height)
{
    return view->pixels + (int32_t)(y - height / 2) * view->stride + (x - width / 2);
}

static int block_inside(const image_view_t *view, int x, int y, int width, int height)
{
    return x - width / 2 >= 0 && y - height / 2 >= 0 && x - width / 2 + width <= view->width &&
           y - height / 2 + height <= view->height;
}

static uint32_t sad(const uint8_t *a, int a_stride, const uint8_t *b, int b_stride, int width,
                    int height)
{
    uint32_t sum = 0;
    int i;

    for (; height; height--, a += a_stride, b += b_stride)
        for (i = 0; i < width; i++)
            sum += (uint32_t)(a[i] > b[i] ? a[i] - b[i] : b[i] - a[i]);
    return sum;
}

static uint32_t ssd(const uint8_t *a, int a_stride, const uint8_t *b, int b_stride, int width,
                    int height)
{
    uint32_t sum = 0;
    int i;

    for (; height; height--, a += a_stride, b += b_stride)
        for (i = 0; i < width; i++)
            sum += (uint32_t)((a[i] - b[i]) * (a[i] - b[i]));
    return sum;
}

static uint32_t correlation(const uint8_t *a, int a_stride, const uint8_t *b, int b_stride,
                            int width, int height)
{
    uint32_t sum = 0;
    int i;

    for (; height; height--, a += a_stride, b += b_stride)
        for (i = 0; i < width; i++)
            sum += (uint32_t)(a[i] * b[i]);
    return sum;
}

/* Integer square root, rounded down. */
static uint32_t square_root(uint64_t value)
{
    uint64_t root = 0;
    uint64_t bit = (uint64_t)1 << 62;

    while (bit > value)
        bit >>= 2;
    for (; bit; bit >>= 2) {
        if (value >= root + bit) {
            value -= root + bit;
            root = (root >> 1) + bit;
        } else {
            root >>= 1;
        }
    }
    return (uint32_t)root;
}

static uint32_t normalised(uint32_t product, uint32_t energy_a, uint32_t energy_b)
{
    /* Both energies are below 2^26, so 2^10 more in the root keeps five bits below the pixel. */
    uint64_t energy = (uint64_t)square_root(((uint64_t)energy_a * energy_b) << 10);

    if (energy == 0)
        return 0;
    energy = (((uint64_t)product << 25) + energy / 2) / energy;
    return energy > MATCH_NCC_ONE ? MATCH_NCC_ONE : (uint32_t)energy;
}

uint32_t match_cost(match_method_t method, const image_view_t *a, int ax, int ay,
                    const image_view_t *b, int bx, int by, int block_width, int block_height)
{
    const uint8_t *pa = block_corner(a, ax, ay, block_width, block_height);
    const uint8_t *pb = block_corner(b, bx, by, block_width, block_height);

    switch (method) {
    case MATCH_SSD:
        return ssd(pa, a->stride, pb, b->stride, block_width, block_height);
    case MATCH_CORR:
        return correlation(pa, a->stride, pb, b->stride, block_width, block_height);
    case MATCH_NCC:
        return normalised(correlation(pa, a->stride, pb, b->stride, block_width, block_height),
                          correlation(pa, a->stride, pa, a->stride, block_width, block_height),
                          correlation(pb, b->stride, pb, b->stride, block_width, block_height));
    case MATCH_SAD:
    default:
        return sad(pa, a->stride, pb, b->stride, block_width, block_height);
    }
}

static uint32_t texture_of(const image_view_t *view, int x, int y, int width, int height)
{
    const uint8_t *row = block_corner(view, x, y, width, height);
    uint32_t sum = 0;
    int i;

    for (; height; height--, row += view->stride)
        for (i = 1; i < width; i++)
            sum += (uint32_t)(row[i] > row[i - 1] ? row[i] - row[i - 1] : row[i - 1] - row[i]);
    return sum;
}

int match_subpixel_q4(match_method_t method, uint32_t before, uint32_t best, uint32_t after)
{
    /* Differences to the best, never negative. */
    int64_t rise_before = (int64_t)before - best;
    int64_t rise_after = (int64_t)after - best;
    int64_t divisor;
    int64_t dividend;

    if (higher_is_better(method)) {
        rise_before = -rise_before;
        rise_after = -rise_after;
    }
    if (method == MATCH_SAD)
        divisor = 2 * (rise_before > rise_after ? rise_before : rise_after);
    else
        divisor = 2 * (rise_before + rise_after);
    if (divisor <= 0)
        return 0;
    /* Steeper before than after: the extreme lies further on. Rounded to nearest. */
    dividend = 16 * (rise_before - rise_after);
    dividend += dividend < 0 ? -divisor / 2 : divisor / 2;
    return (int)(dividend / divisor);
}

static int params_fit(const image_view_t *left, const image_view_t *right, const match_params_t *p)
{
    return left->width == right->width && left->height == right->height && p->block_width >= 1 &&
           p->block_width <= MATCH_MAX_BLOCK && p->block_height >= 1 &&
           p->block_height <= MATCH_MAX_BLOCK && p->disparity_min <= p->disparity_max &&
           p->method <= MATCH_NCC && p->uniqueness_percent <= 99;
}

typedef struct {
    const image_view_t *reference;
    const image_view_t *other;
    const match_params_t *params;
    int x;
    int y;
} search_t;

/* Cost at disparity d in the row y + row_offset of the other eye. Returns 0 beyond its border. */
static int cost_at(const search_t *s, int d, int row_offset, uint32_t *cost)
{
    int x = s->params->reference_is_right ? s->x + d : s->x - d;
    int y = s->y + row_offset;

    if (!block_inside(s->other, x, y, s->params->block_width, s->params->block_height))
        return 0;
    *cost = match_cost(s->params->method, s->reference, s->x, s->y, s->other, x, y,
                       s->params->block_width, s->params->block_height);
    return 1;
}

/* The best cost over all rows searched at disparity d; rows in the order 0, -1, +1, -2, ... */
static int best_row(const search_t *s, int d, uint32_t *cost, int *row_offset)
{
    int found = 0;
    int i;

    for (i = 0; i <= 2 * s->params->rows; i++) {
        int offset = i & 1 ? -(i + 1) / 2 : i / 2;
        uint32_t here;

        if (cost_at(s, d, offset, &here) && (!found || is_better(s->params->method, here, *cost))) {
            *cost = here;
            *row_offset = offset;
            found = 1;
        }
    }
    return found;
}

static int search(const search_t *s, match_t *match)
{
    uint32_t costs[MATCH_MAX_DISPARITY + 1];
    uint8_t valid[MATCH_MAX_DISPARITY + 1];
    match_method_t method = s->params->method;
    int best = -1;
    int d;

    for (d = s->params->disparity_min; d <= s->params->disparity_max; d++) {
        int row_offset = 0;

        valid[d] = (uint8_t)best_row(s, d, &costs[d], &row_offset);
        if (valid[d] && (best < 0 || is_better(method, costs[d], costs[best]))) {
            best = d;
            match->row_offset = (int8_t)row_offset;
        }
    }
    if (best < 0)
        return 0;

    match->disparity = (uint8_t)best;
    match->cost = costs[best];
    match->second_cost = worst_cost(method);
    for (d = s->params->disparity_min; d <= s->params->disparity_max; d++)
        if ((d < best - 1 || d > best + 1) && valid[d] &&
            is_better(method, costs[d], match->second_cost))
            match->second_cost = costs[d];
    match->disparity_q4 = (uint16_t)(16 * best);
    if (best > s->params->disparity_min && best < s->params->disparity_max && valid[best - 1] &&
        valid[best + 1])
        match->disparity_q4 =
            (uint16_t)(16 * best +
                       match_subpixel_q4(method, costs[best - 1], costs[best], costs[best + 1]));
    return 1;
}

static int leads_home(const search_t *s, const match_t *match)
{
    match_params_t params = *s->params;
    search_t back = *s;
    match_t home;
    int difference;

    params.reference_is_right = (uint8_t)!params.reference_is_right;
    back.params = &params;
    back.reference = s->other;
    back.other = s->reference;
    back.x = s->params->reference_is_right ? s->x + match->disparity : s->x - match->disparity;
    back.y = s->y + match->row_offset;
    if (!search(&back, &home))
        return 0;
    difference = (int)home.disparity - match->disparity;
    return difference <= s->params->left_right_max && -difference <= s->params->left_right_max;
}

static uint8_t failed_checks(const search_t *s, const match_t *match)
{
    const match_params_t *p = s->params;
    uint8_t failed = 0;

    if (match->second_cost != worst_cost(p->method)) {
        uint64_t best = (uint64_t)match->cost * 100u;
        uint64_t second = (uint64_t)match->second_cost;
        int unique = higher_is_better(p->method) ? second * (100u + p->uniqueness_percent) < best
                                                 : second * (100u - p->uniqueness_percent) > best;

        if (!unique)
            failed |= CHECK_UNIQUENESS;
    }
    if (is_better(p->method, p->similarity_limit, match->cost))
        failed |= CHECK_SIMILARITY;
    if (match->texture < p->texture_min)
        failed |= CHECK_TEXTURE;
    if ((p->checks & CHECK_LEFT_RIGHT) && !leads_home(s, match))
        failed |= CHECK_LEFT_RIGHT;
    return failed & p->checks;
}

match_error_t match_find(const image_view_t *left, const image_view_t *right, int x, int y,
                         const match_params_t *params, match_t *match)
{
    search_t s;
    match_t found = {0, 0, 0, 0, 0, 0, 0};

    if (!params_fit(left, right, params))
        return MATCH_BAD_PARAM;
    s.reference = params->reference_is_right ? right : left;
    s.other = params->reference_is_right ? left : right;
    s.params = params;
    s.x = x;
    s.y = y;
    if (!block_inside(s.reference, x, y, params->block_width, params->block_height) ||
        !search(&s, &found))
        return MATCH_BORDER;
    found.texture = texture_of(s.reference, x, y, params->block_width, params->block_height);
    found.failed = failed_checks(&s, &found);
    *match = found;
    return MATCH_OK;
}

void match_check_ordering(match_method_t method, match_t *matches, const int16_t *x_other,
                          uint16_t count)
{
    uint16_t i;

    for (i = 1; i < count; i++) {
        uint16_t j = i;

        if (matches[i].failed)
            continue;
        /* Back over all that this one crosses; it goes itself as soon as one of them is better. */
        while (j-- > 0) {
            if (matches[j].failed || x_other[j] < x_other[i])
                continue;
            if (is_better(method, matches[i].cost, matches[j].cost)) {
                matches[j].failed |= CHECK_ORDERING;
            } else {
                matches[i].failed |= CHECK_ORDERING;
                break;
            }
        }
    }
}

static int is_far(const match_t *a, const match_t *b, uint16_t limit_q4)
{
    int32_t difference = (int32_t)a->disparity_q4 - b->disparity_q4;

    return difference > limit_q4 || -difference > limit_q4;
}

void match_check_continuity(match_t *matches, uint16_t count, uint16_t limit_q4)
{
    const match_t *before = 0;
    uint16_t i;

    for (i = 0; i < count; i++) {
        match_t *here = &matches[i];
        const match_t *after = 0;
        uint16_t j;

        if (here->failed)
            continue;
        for (j = (uint16_t)(i + 1); j < count && !after; j++)
            if (!matches[j].failed)
                after = &matches[j];
        if ((before || after) && (!before || is_far(here, before, limit_q4)) &&
            (!after || is_far(here, after, limit_q4)))
            here->failed |= CHECK_CONTINUITY;
        /* A match that stands alone still separates its neighbours for this pass. */
        before = here;
    }
}
