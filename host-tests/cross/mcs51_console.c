/* What a Unity program needs to run on ucsim: a character output and an end. Both go through the
 * simulator's interface, which run-s51 places at FFFF: 'p' and a character prints it, 's' stops. */
#include <stdio.h>

static __xdata volatile unsigned char __at(0xFFFF) simulator;

int unity_main(void);

int putchar(int character)
{
    simulator = 'p';
    simulator = (unsigned char)character;
    return character;
}

void main(void)
{
    (void)unity_main();
    simulator = 's';
}
