#include "link/bytes.h"
#include "link/requests.h"

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
