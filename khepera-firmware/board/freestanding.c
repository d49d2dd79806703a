/* The four functions that GCC calls by itself in a freestanding program (GCC manual, "Standards").
 *
 * Written so that the optimiser cannot turn their loops into calls of themselves. */
#include <stddef.h>
#include <stdint.h>

void *memcpy(void *to, const void *from, size_t size);
void *memmove(void *to, const void *from, size_t size);
void *memset(void *at, int value, size_t size);
int memcmp(const void *a, const void *b, size_t size);

/* May alias anything. */
typedef uint32_t whole_t __attribute__((may_alias, aligned(2)));

#define NO_IDIOM __attribute__((optimize("no-tree-loop-distribute-patterns")))

NO_IDIOM void *memcpy(void *to, const void *from, size_t size)
{
    uint8_t *target = to;
    const uint8_t *source = from;

    /* Structures lie at even addresses. GCC's own code for their copies reads them by longs too. */
    if ((((uintptr_t)to | (uintptr_t)from) & 1u) == 0)
        for (; size >= sizeof(whole_t); size -= sizeof(whole_t)) {
            *(whole_t *)(void *)target = *(const whole_t *)(const void *)source;
            target += sizeof(whole_t);
            source += sizeof(whole_t);
        }
    while (size-- > 0)
        *target++ = *source++;
    return to;
}

NO_IDIOM void *memmove(void *to, const void *from, size_t size)
{
    uint8_t *target = to;
    const uint8_t *source = from;

    if (target <= source)
        return memcpy(to, from, size);
    while (size-- > 0)
        target[size] = source[size];
    return to;
}

NO_IDIOM void *memset(void *at, int value, size_t size)
{
    uint8_t *target = at;

    while (size-- > 0)
        *target++ = (uint8_t)value;
    return at;
}

NO_IDIOM int memcmp(const void *a, const void *b, size_t size)
{
    const uint8_t *left = a;
    const uint8_t *right = b;

    for (; size > 0; size--, left++, right++)
        if (*left != *right)
            return *left - *right;
    return 0;
}
