#include "link/bytes.h"
#include "link/crc.h"
#include "link/slots.h"

void slot_record_encode(uint8_t kind, uint32_t sequence, uint8_t wire[SLOT_RECORD_SIZE])
{
    wire[0] = kind;
    wire[1] = 0;
    be_put32(wire + 2, sequence);
    be_put16(wire + 6, crc16_ccitt(CRC16_INIT, wire, 6));
}
