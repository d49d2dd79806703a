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
static volatile int32_t count[2];

/* Thousands of edges a second: kept so short that the compiler needs one register. Rolling forward,
 * A and B differ right after an edge of A. */
INTERRUPT void encoder_left_isr(void);
INTERRUPT void encoder_left_isr(void)
{
    uint8_t pins;

    /* A flag clears by being read as 1 and then written as 0; ones leave the others alone. */
    (void)TFLG1;
    TFLG1 = (uint8_t)~TFLG1_IC1;
    pins = PORTGP & (LEFT_A | LEFT_B);
    if (pins == 0 || pins == (LEFT_A | LEFT_B))
        count[0]--;
    else
        count[0]++;
}

INTERRUPT void encoder_right_isr(void);
INTERRUPT void encoder_right_isr(void)
{
    uint8_t pins;

    (void)TFLG1;
    TFLG1 = (uint8_t)~TFLG1_IC2;
    pins = PORTGP & (RIGHT_A | RIGHT_B);
    if (pins == 0 || pins == (RIGHT_A | RIGHT_B))
        count[1]--;
    else
        count[1]++;
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
