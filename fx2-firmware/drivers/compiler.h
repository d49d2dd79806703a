/* What the 8051's compiler needs beyond C99, and what it becomes on a PC.
 *
 * app/ is compiled for both; nothing there may use an extension except through this header. */
#ifndef DRIVERS_COMPILER_H
#define DRIVERS_COMPILER_H

#ifdef __SDCC
/* Where an object lives: the scratch RAM, or the program memory (constants). */
#define XDATA             __xdata
#define CODE              __code
/* Declares or defines an interrupt service routine. The prototype must be visible where main() is
 * compiled, or sdcc leaves the vector empty. */
#define ISR(name, vector) void name(void) __interrupt(vector)
#else
#define XDATA
#define CODE
#define ISR(name, vector) void name(void)
#endif

#endif
