/* What the 8051's compiler needs beyond C99, and what it becomes on a PC.
 *
 * app/ is compiled for both; nothing there may use an extension except through this header. */
#ifndef DRIVERS_COMPILER_H
#define DRIVERS_COMPILER_H

#ifdef __SDCC
/* Where an object lives: the scratch RAM, the upper half of the internal RAM, or the program memory
 * (constants). AT: at which address. */
#define XDATA             __xdata
#define IDATA             __idata
#define CODE              __code
#define AT(address)       __at(address)
/* Defines a function of this file that is called in one place: the 8051's compiler puts it there,
 * which saves the call. */
#define ONCE              inline
/* Declares or defines an interrupt service routine. The prototype must be visible where main() is
 * compiled, or sdcc leaves the vector empty. */
#define ISR(name, vector) void name(void) __interrupt(vector)
#else
#define XDATA
#define IDATA
#define CODE
#define AT(address)
#define ONCE              static
#define ISR(name, vector) void name(void)
#endif

#endif
