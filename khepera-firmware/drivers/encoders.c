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

void encoders_init(void)
{
    ICR = ICR_VALUE;
    TCTL2 = TCTL2_ANY_EDGES;
    (void)TFLG1;
    TFLG1 = 0;
    TMSK1 = TFLG1_IC1 | TFLG1_IC2;
}

void encoders_read(int32_t counts[2])
{
    counts[0] = encoders_left;
    counts[1] = encoders_right;
}
