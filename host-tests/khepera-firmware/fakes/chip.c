#include "board/access.h"

_Alignas(16) uint8_t fake_registers[0x1000];
int fake_masked;
