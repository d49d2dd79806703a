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

/* Counts from one look to the next, 10 ms. A motor reversed at full duty brakes a wheel by 10 mm/s
 * a millisecond and another 10 for each 0.5 m/s it has: from 500 mm/s on it does not stand within a
 * period (60 counts). Below that, and driven the way it turns or not at all, it only rolls out. */
#define BRISK_COUNTS 16 /* 130 mm/s: by pulses from here, */
#define SLACK_COUNTS 12 /* ... and by edges below */
#define RUSH_COUNTS  60
/* So many brisk periods in a row, driven the same way all the time: then its direction is sure. */
#define STEADY_LOOKS 2
/* Edges are at least 80 us apart: a second look finds the counter at rest. */
#define LOOKS_MAX    4

typedef struct {
    uint8_t capture; /* its bit in TMSK1 and TFLG1 */
    uint8_t pin;     /* channel A in PORTGP */
    uint8_t pulses;  /* rising edges when last looked at, wraps */
    uint8_t high;    /* A then, 0 or 1 */
    int8_t by_pulses; /* 0: by edges; else the direction in which it is counted */
    int8_t driven;    /* direction of its motor's duty, 0 = none */
    uint8_t steady;   /* brisk looks so far; saturates */
    int32_t counts;   /* at the last look */
    int32_t moved;    /* ... since the one before */
} encoder_t;

static encoder_t encoder[2] = {
    {TFLG1_IC1, LEFT_A, 0, 0, 0, 0, 0, 0, 0},
    {TFLG1_IC2, RIGHT_A, 0, 0, 0, 0, 0, 0, 0},
};

static volatile int32_t *sum_of(unsigned wheel)
{
    return wheel == 0 ? &encoders_left : &encoders_right;
}

static uint8_t counter_of(unsigned wheel)
{
    return wheel == BOARD_PAI_WHEEL ? PACNT : (uint8_t)TCNT;
}

/* TCNT's clock can be chosen once after a reset; a loader that needed it has chosen another. */
static int has_counter(unsigned wheel)
{
    return wheel == BOARD_PAI_WHEEL || (TMSK2 & TMSK2_CPR_PCLK) == TMSK2_CPR_PCLK;
}

/* Counter and level of one moment. */
static void look(unsigned wheel)
{
    encoder_t *at = &encoder[wheel];
    unsigned looks = 0;

    do {
        at->pulses = counter_of(wheel);
        at->high = (PORTGP & at->pin) != 0;
    } while (counter_of(wheel) != at->pulses && ++looks < LOOKS_MAX);
}

/* Add what the counter has counted. */
static void harvest(unsigned wheel)
{
    encoder_t *at = &encoder[wheel];
    uint8_t pulses = at->pulses;
    uint8_t high = at->high;
    int32_t edges;

    look(wheel);
    /* As many falling edges as rising ones, but for the one that the level tells. */
    edges = 2 * (uint8_t)(at->pulses - pulses) + high - at->high;
    *sum_of(wheel) += at->by_pulses > 0 ? edges : -edges;
}

static void forget_edge(const encoder_t *at)
{
    (void)TFLG1;
    TFLG1 = (uint8_t)~at->capture;
}

/* Not if an edge waits for its interrupt: that one counts it, and the next look tries again. */
static void count_by_pulses(unsigned wheel, int8_t direction)
{
    encoder_t *at = &encoder[wheel];
    uint16_t status = access_mask();

    TMSK1 &= (uint8_t)~at->capture;
    look(wheel);
    if (TFLG1 & at->capture)
        TMSK1 |= at->capture;
    else
        at->by_pulses = direction;
    access_restore(status);
}

/* An edge before the last look is in the counter's sum, one after it will interrupt. */
static void count_by_edges(unsigned wheel)
{
    encoder_t *at = &encoder[wheel];
    uint16_t status = access_mask();
    unsigned looks = 0;

    do {
        forget_edge(at);
        harvest(wheel);
    } while ((TFLG1 & at->capture) && ++looks < LOOKS_MAX);
    at->by_pulses = 0;
    at->steady = 0;
    TMSK1 |= at->capture;
    access_restore(status);
}

static int8_t sign_of(int32_t value)
{
    return (int8_t)((value > 0) - (value < 0));
}

static int may_turn_back(const encoder_t *at)
{
    int32_t speed = at->moved * at->by_pulses;

    return speed < SLACK_COUNTS || (speed < RUSH_COUNTS && at->driven == -at->by_pulses);
}

static void choose_way(unsigned wheel)
{
    encoder_t *at = &encoder[wheel];
    int8_t direction = sign_of(at->moved);

    if (at->by_pulses != 0) {
        if (may_turn_back(at))
            count_by_edges(wheel);
    } else if (at->driven != direction || at->moved * direction < BRISK_COUNTS ||
               !has_counter(wheel)) {
        at->steady = 0;
    } else if (++at->steady >= STEADY_LOOKS) {
        at->steady = STEADY_LOOKS;
        count_by_pulses(wheel, direction);
    }
}

void encoders_init(void)
{
    unsigned wheel;

    for (wheel = 0; wheel < 2; wheel++) {
        encoder[wheel].by_pulses = encoder[wheel].driven = 0;
        encoder[wheel].steady = 0;
        encoder[wheel].counts = *sum_of(wheel);
    }
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
    unsigned wheel;

    for (wheel = 0; wheel < 2; wheel++) {
        encoder_t *at = &encoder[wheel];
        int32_t now;

        if (at->by_pulses != 0)
            harvest(wheel);
        now = *sum_of(wheel);
        at->moved = (int32_t)((uint32_t)now - (uint32_t)at->counts);
        at->counts = now;
        counts[wheel] = now;
        choose_way(wheel);
    }
}

void encoders_driven(int16_t left, int16_t right)
{
    const int16_t duty[2] = {left, right};
    unsigned wheel;

    for (wheel = 0; wheel < 2; wheel++) {
        encoder_t *at = &encoder[wheel];
        int8_t direction = sign_of(duty[wheel]);

        if (at->driven == direction)
            continue;
        at->driven = direction;
        at->steady = 0;
        if (at->by_pulses != 0 && may_turn_back(at))
            count_by_edges(wheel);
    }
}
