/* Back to the loader: a restart, or a stay in it so that a new image can be written.
 *
 * The program leaves a word in RAM and lets the watchdog reset the chip, so that every block of it
 * begins anew. docs/SPEC.md describes the loader. */
#ifndef BOARD_BOOT_H
#define BOARD_BOOT_H

#include <stdint.h>

/* What lies at BOARD_MAILBOX_BASE; anything else means nothing. */
#define BOOT_MAGIC       0x53544159ul /* "STAY", then one of the words below and its complement */
#define BOOT_STAY        0x4C4F4144ul /* stay in the loader */
#define BOOT_RESTART     0x52535452ul /* start the program again */
#define BOOT_CAUSE_ASKED 0x41534B44ul /* loader to program: this start was asked for */

typedef struct {
    uint32_t magic;
    uint32_t word;
    uint32_t complement;
} boot_mailbox_t;

/* Motors off, then reset within 63 ms. They do not return; what shall still leave the console must
 * have left it. May be called from an interrupt. */
void boot_enter_loader(void);
void boot_restart(void);

/* 1 if the watchdog's reset before this start was one that these functions, or sot flash, asked
 * for. */
int boot_was_asked(void);

/* The mailbox itself: the word in it, or 0; and putting a word into it. */
uint32_t boot_mailbox_word(void);
void boot_mailbox_put(uint32_t word);

#endif
