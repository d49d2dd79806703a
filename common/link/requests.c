#include "link/requests.h"

#include "link/bytes.h"

void config_status_encode(const config_status_t *status, uint8_t wire[CONFIG_STATUS_SIZE])
{
    wire[0] = CONFIG_STATUS_VERSION;
    wire[1] = status->result;
    wire[2] = status->slot;
    wire[3] = (uint8_t)((status->init ? 1u : 0u) | (status->done ? 2u : 0u));
    be_put32(wire + 4, status->bytes);
    be_put32(wire + 8, status->time_us);
    be_put32(wire + 12, 0);
}

int config_status_decode(const uint8_t wire[CONFIG_STATUS_SIZE], config_status_t *status)
{
    if (wire[0] != CONFIG_STATUS_VERSION)
        return 0;
    status->result = wire[1];
    status->slot = wire[2];
    status->init = wire[3] & 1u;
    status->done = (wire[3] >> 1) & 1u;
    status->bytes = be_get32(wire + 4);
    status->time_us = be_get32(wire + 8);
    return 1;
}
