#include "drivers/encoders.h"

#include "board/khepera.h"
#include "board/mc68331.h"

#define ICR_VALUE       ((LEVEL_ENCODER << 8) | VECTOR_GPT)
#define TCTL2_ANY_EDGES 0x0F /* EDGE1, EDGE2 = 11 */

/* Written by the capture interrupts only; a long is read in one instruction that no interrupt
 * splits. */
static volatile int32_t count[2];

static inline int32_t step(uint8_t pins, uint8_t a, uint8_t b)
{
    return ((pins >> a ^ pins >> b) & 1) ? 1 : -1;
}

void encoder_left_isr(void) __attribute__((interrupt_handler));
void encoder_left_isr(void)
{
    /* A flag clears by being read as 1 and then written as 0; ones leave the others alone. */
    (void)TFLG1;
    TFLG1 = (uint8_t)~TFLG1_IC1;
    count[0] += step(PORTGP, BOARD_GP_LEFT_A, BOARD_GP_LEFT_B);
}

void encoder_right_isr(void) __attribute__((interrupt_handler));
void encoder_right_isr(void)
{
    (void)TFLG1;
    TFLG1 = (uint8_t)~TFLG1_IC2;
    count[1] += step(PORTGP, BOARD_GP_RIGHT_A, BOARD_GP_RIGHT_B);
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
    counts[0] = count[0];
    counts[1] = count[1];
}
