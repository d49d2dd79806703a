#include "drivers/motors.h"

#include "board/khepera.h"
#include "board/mc68331.h"

#define PWMC_DIVIDE_4 0x10 /* PPR = 1, fast mode on both: 25.166 MHz / 4 / 256 */
#if MOTOR_CLOCK_DIVIDER != 4
#error "PWMC_DIVIDE_4 belongs to another divider"
#endif
#define LEFT_FORWARD  (1u << BOARD_GP_LEFT_FORWARD)
#define RIGHT_FORWARD (1u << BOARD_GP_RIGHT_FORWARD)

void motors_init(void)
{
    PWMAB = 0;
    PWMC = PWMC_DIVIDE_4;
    PORTGP = LEFT_FORWARD | RIGHT_FORWARD;
    DDRGP = LEFT_FORWARD | RIGHT_FORWARD;
}

static uint8_t duty(int16_t drive)
{
    int32_t size = drive < 0 ? -(int32_t)drive : drive;

    return (uint8_t)(size > MOTOR_FULL ? MOTOR_FULL : size);
}

void motors_drive(int16_t left, int16_t right)
{
    uint8_t direction = 0;

    if (left >= 0)
        direction |= LEFT_FORWARD;
    if (right >= 0)
        direction |= RIGHT_FORWARD;
    PORTGP = direction;
    PWMAB = (uint16_t)(duty(left) << 8 | duty(right));
}
