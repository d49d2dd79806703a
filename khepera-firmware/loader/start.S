/* From reset to the loader's main(): the chip's set-up, once for loader and program.
 *
 * Until the chip selects are set there is no RAM, hence no stack: registers only. */
#include "board/khepera.h"
#define REG8(address)  address
#define REG16(address) address
#include "board/mc68331.h"

/* SWE, no prescaler, 2^11 crystal periods = 62.5 ms; halt monitor and bus monitor (64 clocks) on.
 * Write-once. */
#define SYPCR_VALUE   0x9C
/* Chip select options: asynchronous, address strobe, BOARD_WAIT_STATES, any address space. */
#define CS_OPTIONS    (0x0030 + (BOARD_WAIT_STATES << 6))
#define CS_READ       0x0800
#define CS_READ_WRITE 0x1800
#define CS_LOWER      0x2000
#define CS_UPPER      0x4000
#define CS_BOTH       0x6000
#define CS_512K       0x0006
/* CS2 answers the acknowledge cycle of the attention interrupt in CPU space with AVEC. */
#define CS_CPU_SPACE  0xFFF8
#define CS_AVEC       (CS_BOTH + CS_READ + (BOARD_TURRET_ATTENTION_IRQ << 1) + 1)
/* CSBOOT, CS0, CS1, CS2 as 16-bit chip selects; the rest of the pins are plain outputs. */
#define CSPAR0_VALUE  0x00FF
/* The clock locks within 20 ms; a turn of the loop takes 40 clocks of 8 MHz at the very least. */
#define LOCK_TRIES    16000

    .section .reset_vectors, "a"
    .long stack_top
    .long reset_entry

    .section .vectors, "a"
vectors:
    .rept 256
    .long dead
    .endr

    .section .start, "ax"
    .global reset_entry
reset_entry:
    move.w  #0x2700, %sr
    move.b  #SYPCR_VALUE, SYPCR

    /* First the VCO's frequency with the output halved (X = 0), then, once it is stable, X. */
    move.w  #(BOARD_SYNCR & ~SYNCR_X), SYNCR
    move.w  #LOCK_TRIES, %d0
wait_lock:
    move.b  #0x55, SWSR
    move.b  #0xAA, SWSR
    move.w  SYNCR, %d1
    andi.w  #SYNCR_SLOCK, %d1
    dbne    %d0, wait_lock
    beq     unlocked
    move.w  #BOARD_SYNCR, SYNCR
unlocked:
    /* Without lock the chip runs at half its speed or less: better than not at all, and the
     * console's odd baud rate shows it. */

    /* The flash may be written to: its commands guard it, and sector 0 is protected. */
    move.w  #cs_flash_base + CS_512K, CSBARBT
    move.w  #(CS_OPTIONS + CS_BOTH + CS_READ_WRITE), CSORBT
    move.w  #cs_ram_base + CS_512K, CSBAR0
    move.w  #(CS_OPTIONS + CS_UPPER + CS_READ_WRITE), CSOR0
    move.w  #cs_ram_base + CS_512K, CSBAR1
    move.w  #(CS_OPTIONS + CS_LOWER + CS_READ_WRITE), CSOR1
    move.w  #CS_CPU_SPACE, CSBAR2
    move.w  #CS_AVEC, CSOR2
    move.w  #CSPAR0_VALUE, CSPAR0

    lea     stack_top, %sp
    lea     loader_load, %a0
    lea     loader_first, %a1
copy:
    move.l  (%a0)+, (%a1)+
    cmpa.l  #loader_end, %a1
    bcs     copy
    lea     bss_start, %a0
    bra     clear_test
clear:
    clr.l   (%a0)+
clear_test:
    cmpa.l  #bss_end, %a0
    bcs     clear
    lea     vectors, %a0
    movec   %a0, %vbr
    jmp     main

    .text
/* An exception in the loader: the watchdog starts it anew. */
dead:
    ori.w   #0x0700, %sr
    bra     dead

/* void start_program(uint32_t entry): as after a reset, but for the chip's set-up. */
    .global start_program
start_program:
    move.l  4(%sp), %a0
    jmp     (%a0)

    .section .note.GNU-stack, "", @progbits
