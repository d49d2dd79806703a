/* The emergency stop's word, `estop`, found in a stream of characters wherever it stands: in the
 * middle of a line, of another command, of rubbish. */
#ifndef DRIVERS_STOP_WORD_H
#define DRIVERS_STOP_WORD_H

#include <stdint.h>

/* Feed the next character; *matched (start with 0) is how many of the word's have come. Returns 1
 * when the word is complete. */
static inline int stop_word_take(uint8_t *matched, uint8_t character)
{
    static const char word[] = "estop";

    /* No character of the word but its first is an `e`, so a mismatch can only restart there. */
    if (character != (uint8_t)word[*matched])
        *matched = 0;
    if (character == (uint8_t)word[*matched])
        (*matched)++;
    if (word[*matched] != '\0')
        return 0;
    *matched = 0;
    return 1;
}

#endif
