/* Before the definition of a function that most ticks do not call: inlined, it would make all of
 * them save its registers, eight bus cycles each. */
#ifndef APP_SELDOM_H
#define APP_SELDOM_H

#ifdef __GNUC__
#define SELDOM __attribute__((noinline))
#else
#define SELDOM
#endif

#endif
