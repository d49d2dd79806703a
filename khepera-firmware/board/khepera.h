/* The Khepera base around the 68331.
 *
 * The wiring of the base is not public: every number here that is not marked otherwise is an
 * ASSUMPTION of ours. This is its only home; firmware and twin both read it. Plain numbers only, so
 * that any compiler can read it. */
#ifndef BOARD_KHEPERA_H
#define BOARD_KHEPERA_H

/* Memory: sizes from the paper, section 3; addresses assumed. */
#define BOARD_FLASH_BASE  0x000000ul /* CSBOOT */
#define BOARD_FLASH_SIZE  0x080000ul
#define BOARD_RAM_BASE    0x100000ul /* CS0 (upper byte) and CS1 (lower byte) */
#define BOARD_RAM_SIZE    0x080000ul
#define BOARD_WAIT_STATES 1 /* of both, in system clocks beyond the 3 of a bus cycle */

/* What lies where in the flash: one chip of AMD's command set, 16 bits wide, with sectors of 16, 8,
 * 8, 32 and seven times 64 KiB (Am29F400BB kind). The rest is free. */
#define BOARD_LOADER_SIZE       0x004000ul /* sector 0, protected: vectors and resident loader */
#define BOARD_PARAMETER_A       0x004000ul /* two sectors for saved parameters */
#define BOARD_PARAMETER_B       0x006000ul
#define BOARD_PARAMETER_SIZE    0x002000ul /* of each */
#define BOARD_IMAGE_A           0x010000ul /* two banks for images (common/link/base_image.h) */
#define BOARD_IMAGE_B           0x040000ul
#define BOARD_IMAGE_BANK_SIZE   0x030000ul
#define BOARD_IMAGE_SECTOR_SIZE 0x010000ul

/* What lies where in the RAM. The program runs from it, copied there by the loader. */
#define BOARD_STACK_SIZE   0x002000ul /* at the bottom: an overflow leaves the RAM and is noticed */
#define BOARD_NOINIT_BASE  0x102000ul /* survives a reset: the crash record */
#define BOARD_NOINIT_SIZE  0x0007F0ul
#define BOARD_MAILBOX_BASE 0x1027F0ul /* from program to loader (board/boot.h) */
#define BOARD_MAILBOX_SIZE 0x000010ul
#define BOARD_PROGRAM_BASE 0x102800ul
#define BOARD_PROGRAM_END  0x178000ul
#define BOARD_LOADER_RAM   0x178000ul /* the loader's, to the end; the program may use it later */

/* Crystal, and SYNCR for 25.166 MHz (4 * 32768 * (Y+1) * 2^(2W+X), W=1 X=1 Y=23). */
#define BOARD_CRYSTAL_HZ 32768ul
#define BOARD_SYNCR      0xD700u
#define BOARD_SYSTEM_HZ  25165824ul

/* Motors: PWMA = left, PWMB = right, fast mode, 0..255; direction on port GP (1 = forward). */
#define BOARD_GP_LEFT_FORWARD  5 /* PORTGP bit, OC3 pin as output */
#define BOARD_GP_RIGHT_FORWARD 6 /* PORTGP bit, OC4 pin as output */

/* Encoders: channel A on an input capture (both edges), channel B on a port GP input.
 * One count is one edge of A: 12 per mm of wheel travel, 600 a revolution (K-Team's figures).
 * Rolling forward, B is low at a rising edge of A and high at a falling one. */
#define BOARD_GP_LEFT_A      0 /* IC1 */
#define BOARD_GP_RIGHT_A     1 /* IC2 */
#define BOARD_GP_LEFT_B      2 /* IC3 pin, as plain input */
#define BOARD_GP_RIGHT_B     7 /* IC4/OC5 pin, as plain input */
/* Channel A also goes to a pin whose rising edges a counter counts: 0 = left, 1 = right wheel. */
#define BOARD_PAI_WHEEL      0 /* pulse accumulator, PACNT */
#define BOARD_PCLK_WHEEL     1 /* TCNT by PCLK */
#define BOARD_PULSES_PER_MM  12
#define BOARD_PULSES_PER_REV 600
#define BOARD_WHEEL_BASE_MM  53

/* Chip selects of the QSPI (value of PCS[3:0] while selected; 1111 = none). */
#define BOARD_PCS_ADC              0x0Eu
#define BOARD_PCS_TURRET           0x0Du /* turret bus */
/* The vision turret's identity on the turret bus, and its attention line (active low, level). */
#define BOARD_TURRET_ID            26
#define BOARD_TURRET_ATTENTION_IRQ 4 /* IRQ4 of port F */

/* ADC: TLC1543 kind, 10 bits. A 16-bit transfer sends the input to convert next in bits 15:12 and
 * returns the result before in bits 15:6; a conversion takes 21 us. */
#define BOARD_ADC_PROXIMITY             0 /* inputs 0..7: IR sensors in the order of command N */
#define BOARD_ADC_BATTERY               8
#define BOARD_ADC_BATTERY_FULL_SCALE_MV 10000

/* LEDs on port F, 1 = on. */
#define BOARD_PF_LED0 0
#define BOARD_PF_LED1 1

/* Emitters of the IR sensors on port F, 1 = on: without them the sensors show ambient light. */
#define BOARD_PF_EMITTERS 2

/* Extension bus of K-Team's commands R and W: 64 bytes on D15..8, chip select CS3. */
#define BOARD_EXTENSION_BASE        0x200000ul
#define BOARD_EXTENSION_WAIT_STATES 3

/* Serial line. */
#define BOARD_BAUD 9600ul

#endif
