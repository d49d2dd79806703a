#include "vision/ball.h"

#include "vision/camera.h"
#include "vision/color.h"
#include "vision/depth.h"

/* The middles may differ by ball_rows (two of misalignment, and the outline's noise) and more for a
 * large ball, whose lower part is lost in shadow. */
#define ROW_DIFFERENCE_SHARE 8
/* The centre of the ball is 33.5 mm above the floor; so far off may noise and a nod put it. */
#define MIN_CENTRE_MM        (-25)
#define MAX_CENTRE_MM        90
/* Columns this close to the border: the outline is cut there. */
#define BORDER_PX            3
#define LEFT_END             0
#define RIGHT_END            1
#define NO_END               INT16_MIN

/* A blob taken for the ball, in one eye. */
typedef struct {
    const blob_t *blob;
    int16_t middle_q4; /* column */
    int16_t width_px;
    int16_t height_px;
    int16_t size_px; /* the larger of both: the diameter, unless a border cuts both */
    int16_t row;     /* of the centre */
    uint8_t cut[2];  /* LEFT_END, RIGHT_END: beyond the border */
} candidate_t;

/* The ends of the strip in the rows read again; NO_END where there is none. */
typedef struct {
    int16_t x_q4[EYE_COUNT][2][BALL_MAX_ROWS];
    uint8_t count;
    const eye_params_t *params;
} outline_t;

static int magnitude(int value)
{
    return value < 0 ? -value : value;
}

void ball_begin(ball_finder_t *finder, const eye_params_t *params)
{
    finder->params = params;
    strips_begin(&finder->strips[EYE_LEFT]);
    strips_begin(&finder->strips[EYE_RIGHT]);
}

void ball_row(ball_finder_t *finder, uint8_t row, const uint16_t *left, const uint16_t *right)
{
    strips_row(&finder->strips[EYE_LEFT], row, left, finder->params);
    strips_row(&finder->strips[EYE_RIGHT], row, right, finder->params);
}

/* `min_px`: a blob that may be a ball is at least this wide and high. At the far corner it is 18
 * px.
 */
static int make_candidate(const blob_t *blob, int min_px, candidate_t *c)
{
    if (!blob->strips)
        return 0;
    c->blob = blob;
    c->width_px = (int16_t)(blob->last - blob->first + 1);
    c->height_px = (int16_t)(blob->bottom_row - blob->top_row + 1);
    c->size_px = c->width_px > c->height_px ? c->width_px : c->height_px;
    c->row = (int16_t)((blob->top_row + blob->bottom_row) / 2);
    c->cut[LEFT_END] = blob->first < BORDER_PX;
    c->cut[RIGHT_END] = blob->last >= CAMERA_WIDTH_PX - BORDER_PX;
    /* A ball that a border cuts is as wide as it is high. */
    if (c->cut[LEFT_END] && !c->cut[RIGHT_END])
        c->middle_q4 = (int16_t)(16 * blob->last - 8 * (c->size_px - 1));
    else if (c->cut[RIGHT_END] && !c->cut[LEFT_END])
        c->middle_q4 = (int16_t)(16 * blob->first + 8 * (c->size_px - 1));
    else
        c->middle_q4 = (int16_t)(8 * (blob->first + blob->last));
    if (c->width_px < min_px || c->height_px < min_px)
        return 0;
    /* Half of its strips' place is filled, and it is not much wider than high or the reverse,
     * unless a border cuts it. */
    if (2 * blob->strips < c->height_px)
        return 0;
    if (blob->bottom_row < CAMERA_HEIGHT_PX - 1 && c->width_px > 2 * c->height_px)
        return 0;
    return c->cut[LEFT_END] || c->cut[RIGHT_END] || c->height_px <= 2 * c->width_px;
}

static int touches_bottom(const candidate_t *c)
{
    return c->blob->bottom_row >= CAMERA_HEIGHT_PX - 2;
}

/* Whether a centre seen at this place, with this disparity, lies where a ball on the floor has it.
 */
static int is_on_floor(const candidate_t *c, int16_t disparity_q4)
{
    ground_point_t point;
    int16_t x_q4 = (int16_t)(c->middle_q4 < 0 ? 0 : c->middle_q4);

    return disparity_q4 > 0 &&
           depth_ground_point((uint16_t)x_q4, (uint16_t)(16 * c->row), (uint16_t)disparity_q4,
                              &point) &&
           point.height_mm >= MIN_CENTRE_MM && point.height_mm <= MAX_CENTRE_MM;
}

/* The disparity that a ball of this width has: 50.4/67 of it. */
static int16_t disparity_of_width_q4(int width_px)
{
    return (int16_t)(16L * width_px * CAMERA_BASELINE_UM / (BALL_DIAMETER_MM * 1000L));
}

static int is_cut(const candidate_t *c)
{
    return c->cut[LEFT_END] || c->cut[RIGHT_END] || touches_bottom(c);
}

/* Coarse disparity of a pair: of the ends that both eyes see, the pair of ends whose disparity fits
 * the wider of both widths better. */
static int coarse_disparity_q4(const candidate_t *l, const candidate_t *r)
{
    int by_left = 16 * (l->blob->first - r->blob->first);
    int by_right = 16 * (l->blob->last - r->blob->last);
    int by_width = disparity_of_width_q4(l->width_px > r->width_px ? l->width_px : r->width_px);
    int left_seen = !l->cut[LEFT_END] && !r->cut[LEFT_END];
    int right_seen = !l->cut[RIGHT_END] && !r->cut[RIGHT_END];

    if (left_seen && right_seen && magnitude(by_left - by_right) <= by_width / 8 + 32)
        return (by_left + by_right) / 2;
    if (left_seen && right_seen)
        return magnitude(by_left - by_width) < magnitude(by_right - by_width) ? by_left : by_right;
    if (left_seen)
        return by_left;
    return right_seen ? by_right : by_width;
}

/* How well two blobs are one ball: 0 not at all, else the larger the better. */
static int pair_score(const candidate_t *l, const candidate_t *r, int d_q4, int rows_apart)
{
    int width = l->width_px > r->width_px ? l->width_px : r->width_px;
    int by_width_q4 = disparity_of_width_q4(width);
    int limit = rows_apart + width / ROW_DIFFERENCE_SHARE;

    if (d_q4 < (int)DEPTH_MIN_DISPARITY_Q4)
        return 0;
    if (magnitude(l->row - r->row) > limit)
        return 0;
    /* Wider than its disparity allows: never. Narrower: hidden in part, or cut. */
    if (by_width_q4 > d_q4 + d_q4 / 4 + 32)
        return 0;
    if (!is_cut(l) && !is_cut(r) && 2 * by_width_q4 < d_q4)
        return 0;
    if (!touches_bottom(r) && !touches_bottom(l) && !is_on_floor(r, (int16_t)d_q4))
        return 0;
    return l->width_px + r->width_px;
}

static int single_score(const candidate_t *c)
{
    if (!touches_bottom(c) && !is_on_floor(c, disparity_of_width_q4(c->size_px)))
        return 0;
    return c->width_px;
}

static int best_single(const ball_finder_t *finder, int eye, candidate_t *best)
{
    int best_score = 0;
    unsigned i;

    for (i = 0; i < STRIPS_BLOBS; i++) {
        candidate_t c;
        const blob_t *blob = &finder->strips[eye].blobs[i];
        int score = make_candidate(blob, finder->params->ball_min, &c) ? single_score(&c) : 0;

        if (score > best_score) {
            best_score = score;
            *best = c;
        }
    }
    return best_score;
}

static int best_pair(const ball_finder_t *finder, candidate_t pair[EYE_COUNT])
{
    int min_px = finder->params->ball_min;
    int best_score = 0;
    unsigned i;
    unsigned j;

    for (i = 0; i < STRIPS_BLOBS; i++) {
        candidate_t l;

        if (!make_candidate(&finder->strips[EYE_LEFT].blobs[i], min_px, &l))
            continue;
        for (j = 0; j < STRIPS_BLOBS; j++) {
            candidate_t r;
            int score;

            if (!make_candidate(&finder->strips[EYE_RIGHT].blobs[j], min_px, &r))
                continue;
            score = pair_score(&l, &r, coarse_disparity_q4(&l, &r), finder->params->ball_rows);
            if (score > best_score) {
                best_score = score;
                pair[EYE_LEFT] = l;
                pair[EYE_RIGHT] = r;
            }
        }
    }
    return best_score;
}

/* Place an end of the strip between pixels: `x` is the strip's outermost column, `outward` -1 for
 * its left end and 1 for its right. */
static int16_t place_end(const uint16_t *row, int x, int outward)
{
    int16_t inside = INT16_MIN;
    int16_t outside = INT16_MAX;
    int16_t level[12];
    int16_t before;
    int middle;
    int i;

    /* level[i] is the yellowness from 5 px inside the end to 6 px outside. */
    for (i = 0; i < 12; i++) {
        int at = x + outward * (i - 5);

        if (at < 0 || at >= CAMERA_WIDTH_PX)
            return NO_END;
        level[i] = color_yellowness(row[at]);
        if (i <= 5 && level[i] > inside)
            inside = level[i];
        if (i > 5 && level[i] < outside)
            outside = level[i];
    }
    middle = (inside + outside) / 2;
    /* From the inside out, the last crossing before the outside's lowest level. */
    i = 11;
    while (i > 0 && level[i] < middle)
        i--;
    if (i == 11 || level[i] < middle)
        return NO_END;
    before = level[i];
    return (int16_t)(16 * (x + outward * (i - 5)) +
                     outward * 16 * (before - middle) / (before - level[i + 1]));
}

/* Outermost yellow columns of the row within the candidate's box. */
static int strip_in_row(const uint16_t *row, const candidate_t *c, const eye_params_t *params,
                        uint16_t *first, uint16_t *last)
{
    uint8_t mask[CAMERA_WIDTH_PX];
    uint16_t x = 0;
    uint16_t a;
    uint16_t b;
    int widest = 0;

    color_yellow_mask(row, CAMERA_WIDTH_PX, params, mask);
    while (strips_next(mask, params->strip_gap, &x, &a, &b)) {
        if (a > c->blob->last || b < c->blob->first || b - a < widest)
            continue;
        widest = b - a;
        *first = a;
        *last = b;
    }
    return widest >= 4;
}

static void trace_eye(const frame_pair_t *frames, int eye, const candidate_t *c, int half_rows,
                      int step, outline_t *outline)
{
    int i;

    for (i = 0; i < outline->count; i++) {
        const uint16_t *row = frame_row(frames, eye, c->row - half_rows + i * step);
        uint16_t first;
        uint16_t last;
        int found = strip_in_row(row, c, outline->params, &first, &last);

        outline->x_q4[eye][LEFT_END][i] =
            found && !c->cut[LEFT_END] ? place_end(row, first, -1) : NO_END;
        outline->x_q4[eye][RIGHT_END][i] =
            found && !c->cut[RIGHT_END] ? place_end(row, last, 1) : NO_END;
    }
}

/* The strip's ends in the middle half of the ball, in both eyes. */
static void trace(const frame_pair_t *frames, const candidate_t pair[EYE_COUNT], outline_t *outline)
{
    int height = pair[EYE_LEFT].height_px < pair[EYE_RIGHT].height_px ? pair[EYE_LEFT].height_px
                                                                      : pair[EYE_RIGHT].height_px;
    int half_rows = height / 4;
    int step = 2 * half_rows / BALL_MAX_ROWS + 1;

    outline->count = (uint8_t)(2 * half_rows / step + 1);
    trace_eye(frames, EYE_LEFT, &pair[EYE_LEFT], half_rows, step, outline);
    trace_eye(frames, EYE_RIGHT, &pair[EYE_RIGHT], half_rows, step, outline);
}

/* Mean of values[0..count-1] but NO_END, those far from the mean left out in two more passes: a
 * seam or a line behind the ball spoils single rows. Returns how many remain. */
static int trimmed_mean(const int16_t *values, int count, int16_t *mean)
{
    int32_t centre = 0;
    int limit = INT16_MAX;
    int used = 0;
    int pass;

    for (pass = 0; pass < 3; pass++) {
        int32_t sum = 0;
        int32_t spread = 0;
        int i;

        used = 0;
        for (i = 0; i < count; i++) {
            if (values[i] == NO_END || magnitude((int)(values[i] - centre)) > limit)
                continue;
            sum += values[i];
            spread += pass ? magnitude((int)(values[i] - centre)) : 0;
            used++;
        }
        if (!used)
            return 0;
        centre = sum / used;
        limit = pass ? 2 * (int)(spread / used) + 4 : 6 * 16;
    }
    *mean = (int16_t)centre;
    return used;
}

/* Disparity as one end says, row by row; or the middle of the strip of one eye. */
static int end_disparity(const outline_t *o, int end, int16_t *d_q4)
{
    int16_t values[BALL_MAX_ROWS];
    int i;

    for (i = 0; i < o->count; i++) {
        int16_t l = o->x_q4[EYE_LEFT][end][i];
        int16_t r = o->x_q4[EYE_RIGHT][end][i];

        values[i] = l == NO_END || r == NO_END ? NO_END : (int16_t)(l - r);
    }
    return trimmed_mean(values, o->count, d_q4);
}

static int strip_middle(const outline_t *o, int eye, int16_t *x_q4)
{
    int16_t values[BALL_MAX_ROWS];
    int i;

    for (i = 0; i < o->count; i++) {
        int16_t first = o->x_q4[eye][LEFT_END][i];
        int16_t last = o->x_q4[eye][RIGHT_END][i];

        values[i] = (int16_t)(first == NO_END || last == NO_END ? NO_END : (first + last) / 2);
    }
    return trimmed_mean(values, o->count, x_q4);
}

/* value * (1 - (R/Z)^2), with R/Z = d / 492 (R d / (f T), R = 33.5 mm). */
static int16_t without_ellipse(int value, int d_q4)
{
    int32_t ratio_q12 = (int32_t)d_q4 * 4096 / (492 * 16);

    return (int16_t)(value - value * ((ratio_q12 * ratio_q12) >> 12) / 4096);
}

/* Disparity of the centre from that of one end. A ray that grazes the ball on its outer side sees
 * more of the eyes' distance than one on its inner side, by 1 + (R/Z) (u/f), u being how far off
 * the axis the ball is in the mean of both eyes; R/Z = d / 492. */
static int by_one_end_q4(int end, int d_q4, int right_middle_q4)
{
    int32_t aside_q4 = right_middle_q4 + d_q4 / 2 - CAMERA_CX_Q4;
    int32_t more_q4 = (int32_t)d_q4 * d_q4 / 256 * aside_q4 / (492 * CAMERA_FOCAL_PX);

    return (int)(end == LEFT_END ? d_q4 + more_q4 : d_q4 - more_q4);
}

/* Sub-pixel disparity of the pair from the ends that both eyes see; 0 if none can be placed. */
static int refine_disparity_q4(const candidate_t pair[EYE_COUNT], const outline_t *outline)
{
    int wider = pair[EYE_LEFT].width_px > pair[EYE_RIGHT].width_px ? EYE_LEFT : EYE_RIGHT;
    int by_width = disparity_of_width_q4(pair[wider].width_px);
    int enough = (outline->count + 3) / 4;
    int d_q4[2];
    int seen[2];
    int end;

    for (end = LEFT_END; end <= RIGHT_END; end++) {
        int16_t by_end = 0;

        seen[end] = end_disparity(outline, end, &by_end) >= enough;
        d_q4[end] = by_one_end_q4(end, by_end, pair[EYE_RIGHT].middle_q4);
    }
    if (seen[LEFT_END] && seen[RIGHT_END]) {
        if (magnitude(d_q4[LEFT_END] - d_q4[RIGHT_END]) <= 32 + by_width / 16)
            return (d_q4[LEFT_END] + d_q4[RIGHT_END]) / 2;
        return magnitude(d_q4[LEFT_END] - by_width) < magnitude(d_q4[RIGHT_END] - by_width)
                   ? d_q4[LEFT_END]
                   : d_q4[RIGHT_END];
    }
    if (seen[LEFT_END])
        return d_q4[LEFT_END];
    return seen[RIGHT_END] ? d_q4[RIGHT_END] : 0;
}

static uint16_t in_image_q4(int x_q4)
{
    if (x_q4 < 0)
        return 0;
    return (uint16_t)(x_q4 > 16 * (CAMERA_WIDTH_PX - 1) ? 16 * (CAMERA_WIDTH_PX - 1) : x_q4);
}

/* Centre of the ball in the right image: the middle of its strip, or where one end is missing, the
 * other end and half the width that the disparity asks for. */
static uint16_t centre_q4(const candidate_t *right, const outline_t *outline, int d_q4)
{
    int16_t middle = right->middle_q4;
    int half_width_q4 = d_q4 * (BALL_DIAMETER_MM * 10) / (2 * (int)(CAMERA_BASELINE_UM / 100));

    if (!strip_middle(outline, EYE_RIGHT, &middle)) {
        if (right->cut[LEFT_END] && !right->cut[RIGHT_END])
            middle = (int16_t)(16 * right->blob->last + 8 - half_width_q4);
        else if (right->cut[RIGHT_END] && !right->cut[LEFT_END])
            middle = (int16_t)(16 * right->blob->first - 8 + half_width_q4);
    }
    return in_image_q4(CAMERA_CX_Q4 + without_ellipse(middle - CAMERA_CX_Q4, d_q4));
}

static void fill(report_t *report, const candidate_t *c, int width_px, int confidence)
{
    report->flags |= REPORT_BALL;
    report->ball_x_q4 = in_image_q4(c->middle_q4);
    report->ball_row = (uint8_t)c->row;
    report->ball_width_px = (uint8_t)(width_px > 255 ? 255 : width_px);
    report->ball_confidence = (uint8_t)(confidence < 1 ? 1 : confidence > 255 ? 255 : confidence);
}

/* 255 for a pair whose width and disparity agree; less for what does not fit. */
static int pair_confidence(const candidate_t pair[EYE_COUNT], int d_q4)
{
    const candidate_t *l = &pair[EYE_LEFT];
    const candidate_t *r = &pair[EYE_RIGHT];
    int by_width = disparity_of_width_q4((l->width_px + r->width_px + 1) / 2);

    return 255 - 255 * magnitude(by_width - d_q4) / (d_q4 + 1) -
           16 * magnitude(l->width_px - r->width_px) / (1 + r->width_px / 8) -
           8 * magnitude(l->row - r->row);
}

static void report_pair(const frame_pair_t *frames, const candidate_t pair[EYE_COUNT],
                        const eye_params_t *params, report_t *report)
{
    const candidate_t *right = &pair[EYE_RIGHT];
    outline_t outline;
    int d_q4;

    outline.params = params;
    trace(frames, pair, &outline);
    d_q4 = refine_disparity_q4(pair, &outline);
    if (d_q4 < (int)DEPTH_MIN_DISPARITY_Q4)
        d_q4 = coarse_disparity_q4(&pair[EYE_LEFT], right);
    d_q4 = without_ellipse(d_q4, d_q4);
    fill(report, right, right->width_px, pair_confidence(pair, d_q4));
    report->ball_x_q4 = centre_q4(right, &outline, d_q4);
    if (d_q4 > 16 * params->search_max || touches_bottom(&pair[EYE_LEFT]) || touches_bottom(right))
        report->flags |= REPORT_BALL_CLIPPED;
    else
        report->ball_disparity_q4 = (uint16_t)d_q4;
}

static void report_single(const candidate_t *c, int eye, const eye_params_t *params,
                          report_t *report)
{
    int confidence = is_cut(c) ? 96 : 64;

    fill(report, c, c->width_px, confidence);
    report->flags |= eye == EYE_RIGHT ? REPORT_BALL_RIGHT_ONLY : REPORT_BALL_LEFT_ONLY;
    if (touches_bottom(c) || disparity_of_width_q4(c->size_px) > 16 * params->search_max)
        report->flags |= REPORT_BALL_CLIPPED;
}

void ball_end(const ball_finder_t *finder, const frame_pair_t *frames, report_t *report)
{
    candidate_t pair[EYE_COUNT];
    candidate_t single[EYE_COUNT];
    int in_right;
    int in_left;

    if (best_pair(finder, pair)) {
        report_pair(frames, pair, finder->params, report);
        return;
    }
    in_right = best_single(finder, EYE_RIGHT, &single[EYE_RIGHT]);
    in_left = best_single(finder, EYE_LEFT, &single[EYE_LEFT]);
    if (in_right && in_right >= in_left)
        report_single(&single[EYE_RIGHT], EYE_RIGHT, finder->params, report);
    else if (in_left)
        report_single(&single[EYE_LEFT], EYE_LEFT, finder->params, report);
}
