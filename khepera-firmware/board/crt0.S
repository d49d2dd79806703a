/* From the loader to main(), and what every exception that nobody expects ends in.
 *
 * The loader (loader/start.S) has set up clock, watchdog and chip selects, and copied the program,
 * initialised data included, to where it runs. */
#include "board/crash.h"
#include "board/khepera.h"
#define REG8(address)  address
#define REG16(address) address
#include "board/mc68331.h"

    .section .vectors, "a"
    .global vectors
vectors:
    .long stack_top
    .long program_entry
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
    .long qspi_isr
    .rept VECTOR_ENCODER_LEFT - VECTOR_QSPI - 1
    .long crash_entry
    .endr
    .long encoder_left_isr
    .long encoder_right_isr
    .rept 256 - VECTOR_ENCODER_RIGHT - 1
    .long crash_entry
    .endr

    .text
    .global program_entry
program_entry:
    move.w  #0x2700, %sr
    lea     vectors, %a0
    movec   %a0, %vbr

    lea     stack_top, %sp
    lea     stack_bottom, %a0
    move.l  #STACK_PAINT, %d0
paint_stack:
    move.l  %d0, (%a0)+
    cmpa.l  %sp, %a0
    bcs     paint_stack

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
