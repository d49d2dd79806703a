#include "link/requests.h"

#include "link/bytes.h"

void config_status_encode(const config_status_t *status, uint8_t wire[CONFIG_STATUS_SIZE])
{
    uint8_t pins = 0;

    if (status->init)
        pins |= 1u;
    if (status->done)
        pins |= 2u;
    *wire++ = CONFIG_STATUS_VERSION;
    *wire++ = status->result;
    *wire++ = status->slot;
    *wire++ = pins;
    be_put32(wire, status->bytes);
    be_put32(wire + 4, status->time_us);
    be_put32(wire + 8, 0);
}
