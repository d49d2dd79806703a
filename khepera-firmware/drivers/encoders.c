#include "drivers/encoders.h"

#include "board/khepera.h"
#include "board/mc68331.h"

#define ICR_VALUE       ((LEVEL_ENCODER << 8) | VECTOR_GPT)
#define TCTL2_ANY_EDGES 0x0F /* EDGE1, EDGE2 = 11 */
#define LEFT_A          (1u << BOARD_GP_LEFT_A)
#define LEFT_B          (1u << BOARD_GP_LEFT_B)
#define RIGHT_A         (1u << BOARD_GP_RIGHT_A)
#define RIGHT_B         (1u << BOARD_GP_RIGHT_B)

/* Written by the capture interrupts only; a long is read in one instruction that no interrupt
 * splits. */
extern volatile int32_t encoders_left;
extern volatile int32_t encoders_right;
volatile int32_t encoders_left;
volatile int32_t encoders_right;

/* Thousands of edges a second: every word fetched counts, and so does every register to save;
 * written this way the compiler needs one. Rolling forward, A and B differ right after an edge of
 * A. */
INTERRUPT void encoder_left_isr(void);
INTERRUPT void encoder_left_isr(void)
{
    uint8_t pins;

    /* A flag clears by being read as 1 and then written as 0; ones leave the others alone. */
    (void)TFLG1;
    TFLG1 = (uint8_t)~TFLG1_IC1;
    pins = PORTGP;
    if (pins & LEFT_A) {
        if (pins & LEFT_B)
            ACCESS_DECREMENT(encoders_left);
        else
            ACCESS_INCREMENT(encoders_left);
    } else if (pins & LEFT_B) {
        ACCESS_INCREMENT(encoders_left);
    } else {
        ACCESS_DECREMENT(encoders_left);
    }
}

INTERRUPT void encoder_right_isr(void);
INTERRUPT void encoder_right_isr(void)
{
    uint8_t pins;

    (void)TFLG1;
    TFLG1 = (uint8_t)~TFLG1_IC2;
    pins = PORTGP;
    if (pins & RIGHT_A) {
        if (pins & RIGHT_B)
            ACCESS_DECREMENT(encoders_right);
        else
            ACCESS_INCREMENT(encoders_right);
    } else if (pins & RIGHT_B) {
        ACCESS_INCREMENT(encoders_right);
    } else {
        ACCESS_DECREMENT(encoders_right);
    }
}

/* ---- By edges or by pulses ----
 * The program changes the way; interrupts count by edges only. */

/* Counts from one look to the next, 10 ms. A motor reversed at full duty brakes a wheel by 20 mm/s
 * a millisecond, and by another 10 for each 0.5 m/s it has: after a period of 500 mm/s (60 counts)
 * it still rolls forward at the end of the next one. Below that, and driven the way it turns or not
 * at all, it only rolls out. */
#define BRISK_COUNTS 3 /* 25 mm/s: by pulses from here, */
#define SLACK_COUNTS 2 /* ... and by edges below */
#define RUSH_COUNTS  60
/* So many brisk periods in a row, driven the same way all the time: then its direction is sure. */
#define STEADY_LOOKS 2
/* Edges are at least 80 us apart: after one that comes in between, a second look meets none. */
#define LOOKS_MAX    4

typedef struct {
    volatile int32_t *sum;
    uint8_t capture;  /* its bit in TMSK1 and TFLG1 */
    uint8_t pin;      /* channel A in PORTGP */
    uint8_t pulses;   /* rising edges when last looked at, wraps */
    uint8_t high;     /* A then, as in PORTGP */
    int8_t by_pulses; /* 0: by edges; else the direction in which it is counted */
    int8_t driven;    /* direction of its motor's duty, 0 = none */
    uint8_t steady;   /* brisk looks so far, up to STEADY_LOOKS */
    int32_t counts;   /* at the last look */
    int32_t moved;    /* ... since the one before */
} encoder_t;

static encoder_t encoder[2] = {
    {&encoders_left, TFLG1_IC1, LEFT_A, 0, 0, 0, 0, 0, 0, 0},
    {&encoders_right, TFLG1_IC2, RIGHT_A, 0, 0, 0, 0, 0, 0, 0},
};

#define PAI_ENCODER  (&encoder[BOARD_PAI_WHEEL])
#define PCLK_ENCODER (&encoder[BOARD_PCLK_WHEEL])

/* TCNT's clock can be chosen once after a reset; a loader that needed it has chosen another. */
static int has_counter(const encoder_t *at)
{
    return at == PAI_ENCODER || (TMSK2 & TMSK2_CPR_PCLK) == TMSK2_CPR_PCLK;
}

static uint8_t counter_of(const encoder_t *at)
{
    return at == PAI_ENCODER ? PACNT : (uint8_t)TCNT;
}

/* Counter and level of one moment; returns the edges since the last look. */
static inline int32_t look(encoder_t *at)
{
    uint8_t pulses = counter_of(at);
    uint8_t high = PORTGP & at->pin;
    uint8_t again = counter_of(at);
    int32_t edges;

    if (again != pulses)
        high = PORTGP & at->pin;
    /* As many falling edges as rising ones, but for the one that the level tells. */
    edges = 2 * (uint8_t)(again - at->pulses);
    if (high != at->high)
        edges += high != 0 ? -1 : 1;
    at->pulses = again;
    at->high = high;
    return edges;
}

/* Add what the counter has counted. */
static inline void harvest(encoder_t *at)
{
    int32_t edges = look(at);

    at->moved = at->by_pulses > 0 ? edges : -edges;
    at->counts = (int32_t)((uint32_t)at->counts + (uint32_t)at->moved);
    *at->sum = at->counts;
}

/* Not if an edge waits for its interrupt: that one counts it, and the next look tries again. */
static void count_by_pulses(encoder_t *at, int8_t direction)
{
    uint16_t status = access_mask();

    TMSK1 &= (uint8_t)~at->capture;
    (void)look(at);
    if (TFLG1 & at->capture) {
        TMSK1 |= at->capture;
    } else {
        at->counts = *at->sum;
        at->by_pulses = direction;
    }
    access_restore(status);
}

/* An edge before the last look is in the counter's sum, one after it will interrupt. */
static void count_by_edges(encoder_t *at)
{
    uint16_t status = access_mask();
    unsigned looks = LOOKS_MAX;

    do {
        (void)TFLG1;
        TFLG1 = (uint8_t)~at->capture;
        harvest(at);
    } while ((TFLG1 & at->capture) && --looks > 0);
    at->by_pulses = 0;
    at->steady = 0;
    TMSK1 |= at->capture;
    access_restore(status);
}

/* ---- Which way ---- */

/* Of a wheel counted by pulses. */
static int may_turn_back(const encoder_t *at)
{
    int32_t speed = at->by_pulses > 0 ? at->moved : -at->moved;

    return speed < SLACK_COUNTS || (speed < RUSH_COUNTS && at->driven == -at->by_pulses);
}

/* Of a wheel counted by edges. */
static int is_brisk(const encoder_t *at)
{
    if (at->moved > 0)
        return at->moved >= BRISK_COUNTS && at->driven > 0;
    return at->moved <= -BRISK_COUNTS && at->driven < 0;
}

static void choose_way(encoder_t *at)
{
    if (at->by_pulses != 0) {
        if (may_turn_back(at))
            count_by_edges(at);
    } else if (!is_brisk(at) || !has_counter(at)) {
        at->steady = 0;
    } else if (at->steady + 1u < STEADY_LOOKS) {
        at->steady++;
    } else {
        count_by_pulses(at, at->driven);
    }
}

static void drive(encoder_t *at, int16_t duty)
{
    int8_t direction = (int8_t)(duty > 0 ? 1 : duty < 0 ? -1 : 0);

    if (at->driven == direction)
        return;
    at->driven = direction;
    at->steady = 0;
    if (at->by_pulses != 0 && may_turn_back(at))
        count_by_edges(at);
}

static void begin(encoder_t *at)
{
    at->by_pulses = 0;
    at->driven = 0;
    at->steady = 0;
    at->counts = *at->sum;
}

void encoders_init(void)
{
    begin(PAI_ENCODER);
    begin(PCLK_ENCODER);
    PACTL = PACTL_PAEN | PACTL_PEDGE;
    TMSK2 = TMSK2_CPR_PCLK;
    ICR = ICR_VALUE;
    TCTL2 = TCTL2_ANY_EDGES;
    (void)TFLG1;
    TFLG1 = 0;
    TMSK1 = TFLG1_IC1 | TFLG1_IC2;
}

void encoders_read(int32_t counts[2])
{
    encoder_t *at;

    for (at = &encoder[0]; at < &encoder[2]; at++) {
        if (at->by_pulses != 0) {
            harvest(at);
        } else {
            int32_t now = *at->sum;

            at->moved = (int32_t)((uint32_t)now - (uint32_t)at->counts);
            at->counts = now;
        }
        *counts++ = at->counts;
        choose_way(at);
    }
}

void encoders_driven(int16_t left, int16_t right)
{
    drive(&encoder[0], left);
    drive(&encoder[1], right);
}
