/* From reset to main(), and what every exception that nobody expects ends in.
 *
 * Until the chip selects are set there is no RAM, hence no stack: the first half uses registers
 * only. */
#include "board/crash.h"
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

    .section .vectors, "a"
    .global vectors
vectors:
    .long stack_top
    .long reset_entry
    .rept VECTOR_AUTO_TURRET - 2
    .long crash_entry
    .endr
    .long turret_attention_isr
    .rept VECTOR_TICK - VECTOR_AUTO_TURRET - 1
    .long crash_entry
    .endr
    .long tick_isr
    .long crash_entry
    .long sci_isr
    .long turret_transfer_isr
    .rept VECTOR_ENCODER_LEFT - VECTOR_QSPI - 1
    .long crash_entry
    .endr
    .long encoder_left_isr
    .long encoder_right_isr
    .rept 256 - VECTOR_ENCODER_RIGHT - 1
    .long crash_entry
    .endr

    .text
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
    beq     reset_entry_unlocked
    move.w  #BOARD_SYNCR, SYNCR
reset_entry_unlocked:
    /* Without lock the chip runs at half its speed or less: better than not at all, and the
     * console's odd baud rate shows it. */

    move.w  #cs_flash_base + CS_512K, CSBARBT
    move.w  #(CS_OPTIONS + CS_BOTH + CS_READ), CSORBT
    move.w  #cs_ram_base + CS_512K, CSBAR0
    move.w  #(CS_OPTIONS + CS_UPPER + CS_READ_WRITE), CSOR0
    move.w  #cs_ram_base + CS_512K, CSBAR1
    move.w  #(CS_OPTIONS + CS_LOWER + CS_READ_WRITE), CSOR1
    move.w  #CS_CPU_SPACE, CSBAR2
    move.w  #CS_AVEC, CSOR2
    move.w  #CSPAR0_VALUE, CSPAR0

    lea     stack_top, %sp
    lea     stack_bottom, %a0
    move.l  #STACK_PAINT, %d0
paint_stack:
    move.l  %d0, (%a0)+
    cmpa.l  %sp, %a0
    bcs     paint_stack

    lea     data_load, %a0
    lea     data_start, %a1
    bra     copy_data_test
copy_data:
    move.l  (%a0)+, (%a1)+
copy_data_test:
    cmpa.l  #data_end, %a1
    bcs     copy_data

    lea     bss_start, %a0
    bra     clear_bss_test
clear_bss:
    clr.l   (%a0)+
clear_bss_test:
    cmpa.l  #bss_end, %a0
    bcs     clear_bss

    jsr     main
    /* main() does not return; if it does, the watchdog takes over. */
hang:
    bra     hang

/* Any unexpected exception. Motors off before anything else; the record is written by C on a fresh
 * stack, then the watchdog, which nobody serves any more, resets the chip. */
    .global crash_entry
crash_entry:
    ori.w   #0x0700, %sr
    clr.w   PWMAB
    movem.l %d0-%d7/%a0-%a7, crash_registers
    movea.l %sp, %a0
    lea     stack_top, %sp
    move.l  %a0, -(%sp)
    jsr     crash_save
    bra     hang

    .section .note.GNU-stack, "", @progbits
