/* The registers of the MC68331 that this firmware uses.
 *
 * Names, addresses and bits as in Motorola's user manual (MC68331UM: SIM section 4 and appendix D,
 * QSM section 6, GPT section 7). Modules lie at FFF000..FFFFFF (SIMCR.MM = 1, its reset value);
 * written sign-extended, so that a register is reached by a 16-bit absolute address. */
#ifndef BOARD_MC68331_H
#define BOARD_MC68331_H

/* The assembler wants plain addresses and has its own REG8 and REG16 (board/crt0.S). */
#ifndef REG8
#include "board/access.h"
#endif

/* ---- General-purpose timer ---- */
#define GPTMCR REG16(0xFFFFF900)
#define ICR    REG16(0xFFFFF904) /* IPA 15:12, IPL 10:8, IVBA 7:4 */
#define DDRGP  REG8(0xFFFFF906)
#define PORTGP REG8(0xFFFFF907)
#define TCNT   REG16(0xFFFFF90A)
#define PACTL  REG8(0xFFFFF90C)
#define PACNT  REG8(0xFFFFF90D)
#define TCTL1  REG8(0xFFFFF91E)
#define TCTL2  REG8(0xFFFFF91F)
#define TMSK1  REG8(0xFFFFF920)
#define TMSK2  REG8(0xFFFFF921)
#define TFLG1  REG8(0xFFFFF922)
#define PWMC   REG8(0xFFFFF925)
#define PWMAB  REG16(0xFFFFF926) /* both at once */
#define PWMA   REG8(0xFFFFF926)
#define PWMB   REG8(0xFFFFF927)
#define PWMCNT REG16(0xFFFFF928)

#define TFLG1_IC1 0x01
#define TFLG1_IC2 0x02

#define PACTL_PAEN     0x40
#define PACTL_PEDGE    0x10 /* rising edges count */
#define TMSK2_CPR_PCLK 0x07

/* ---- System integration module ---- */
#define SIMCR   REG16(0xFFFFFA00)
#define SYNCR   REG16(0xFFFFFA04)
#define RSR     REG8(0xFFFFFA07)
#define PORTF   REG8(0xFFFFFA19)
#define DDRF    REG8(0xFFFFFA1D)
#define PFPAR   REG8(0xFFFFFA1F)
#define SYPCR   REG8(0xFFFFFA21)
#define PICR    REG16(0xFFFFFA22) /* PIRQL 10:8, PIV 7:0 */
#define PITR    REG16(0xFFFFFA24)
#define SWSR    REG8(0xFFFFFA27)
#define CSPAR0  REG16(0xFFFFFA44)
#define CSBARBT REG16(0xFFFFFA48)
#define CSORBT  REG16(0xFFFFFA4A)
#define CSBAR0  REG16(0xFFFFFA4C)
#define CSOR0   REG16(0xFFFFFA4E)
#define CSBAR1  REG16(0xFFFFFA50)
#define CSOR1   REG16(0xFFFFFA52)
#define CSBAR2  REG16(0xFFFFFA54)
#define CSOR2   REG16(0xFFFFFA56)
#define CSBAR3  REG16(0xFFFFFA58)
#define CSOR3   REG16(0xFFFFFA5A)

#define RSR_POWER   0x40
#define SYNCR_SLOCK 0x0008
#define SYNCR_X     0x4000

/* ---- Queued serial module ---- */
#define QSMCR            REG16(0xFFFFFC00)
#define QILR             REG8(0xFFFFFC04) /* ILQSPI 5:3, ILSCI 2:0 */
#define QIVR             REG8(0xFFFFFC05) /* SCI: this with bit 0 clear; QSPI: with bit 0 set */
#define SCCR0            REG16(0xFFFFFC08)
#define SCCR1            REG16(0xFFFFFC0A)
#define SCSR             REG16(0xFFFFFC0C)
#define SCDR             REG16(0xFFFFFC0E)
#define PORTQS           REG8(0xFFFFFC15)
#define PQSPAR           REG8(0xFFFFFC16)
#define DDRQS            REG8(0xFFFFFC17)
#define SPCR0            REG16(0xFFFFFC18)
#define SPCR1            REG16(0xFFFFFC1A)
#define SPCR2            REG16(0xFFFFFC1C)
#define SPCR3            REG8(0xFFFFFC1E)
#define SPSR             REG8(0xFFFFFC1F)
#define QSPI_RX(n)       REG16(0xFFFFFD00 + 2 * (n))
#define QSPI_TX(n)       REG16(0xFFFFFD20 + 2 * (n))
#define QSPI_CMD(n)      REG8(0xFFFFFD40 + (n))
/* Commands n and n + 1, n even. */
#define QSPI_CMD_PAIR(n) REG16(0xFFFFFD40 + (n))
#define QSPI_ENTRIES     16u

#define SCCR1_RE      0x0004
#define SCCR1_TE      0x0008
#define SCCR1_RIE     0x0020
#define SCCR1_TIE     0x0080
#define SCSR_FE       0x0002
#define SCSR_NF       0x0004
#define SCSR_OR       0x0008
#define SCSR_IDLE     0x0010
#define SCSR_RDRF     0x0040
#define SCSR_TC       0x0080
#define SCSR_TDRE     0x0100
#define SPCR0_MSTR    0x8000
#define SPCR1_SPE     0x8000
#define SPCR2_SPIFIE  0x8000
#define SPCR3_HALT    0x01
#define SPSR_SPIF     0x80
#define QSPI_CMD_CONT 0x80 /* chip select stays active after this entry */
#define QSPI_CMD_BITS 0x40 /* SPCR0.BITS counts (0 = 16), not 8 */
#define QSPI_CMD_DT   0x20 /* wait SPCR1.DTL after this entry */

/* ---- Interrupts: who gets which level and vector ----
 * Encoders first (an edge unread is a count lost), then time, then the turret, then the console. */
#define LEVEL_ENCODER        6
#define LEVEL_TICK           5
#define LEVEL_TURRET         4 /* attention line and its QSPI transfer */
#define LEVEL_CONSOLE        3
#define VECTOR_AUTO_TURRET   28 /* autovector of level 4 */
#define VECTOR_TICK          64
#define VECTOR_SCI           66 /* even; QSPI is the odd one after it */
#define VECTOR_QSPI          67
#define VECTOR_GPT           80 /* IVBA = 5; + source number */
#define VECTOR_ENCODER_LEFT  81 /* IC1 */
#define VECTOR_ENCODER_RIGHT 82 /* IC2 */
/* Interrupt arbitration numbers: one of its own for each module, never 0 (the SIM keeps 15). */
#define IARB_GPT             14
#define IARB_QSM             13

#endif
