#include "board/boot.h"

#include "board/khepera.h"
#include "board/mc68331.h"

/* The linker script puts it at BOARD_MAILBOX_BASE. */
static volatile boot_mailbox_t mailbox __attribute__((section(".mailbox"), used));

uint32_t boot_mailbox_word(void)
{
    if (mailbox.magic != BOOT_MAGIC || mailbox.complement != ~mailbox.word)
        return 0;
    return mailbox.word;
}

void boot_mailbox_put(uint32_t word)
{
    mailbox.magic = BOOT_MAGIC;
    mailbox.word = word;
    mailbox.complement = ~word;
}

static void reset(uint32_t word)
{
    __asm__ volatile("ori.w #0x0700, %%sr" : : : "memory", "cc");
    PWMAB = 0;
    boot_mailbox_put(word);
    for (;;) {
        /* The watchdog, which nobody serves any more, ends this. */
    }
}

void boot_enter_loader(void)
{
    reset(BOOT_STAY);
}

void boot_restart(void)
{
    reset(BOOT_RESTART);
}

int boot_was_asked(void)
{
    return boot_mailbox_word() == BOOT_CAUSE_ASKED;
}
