#include "link/requests.h"

#include "link/bytes.h"

int config_status_decode(const uint8_t wire[CONFIG_STATUS_SIZE], config_status_t *status)
{
    uint8_t pins = wire[CONFIG_STATUS_AT_PINS];

    if (wire[0] != CONFIG_STATUS_VERSION)
        return 0;
    status->result = wire[CONFIG_STATUS_AT_RESULT];
    status->slot = wire[CONFIG_STATUS_AT_SLOT];
    status->init = pins & 1u;
    status->done = (pins >> 1) & 1u;
    status->bytes = be_get32(wire + CONFIG_STATUS_AT_BYTES);
    status->time_us = be_get32(wire + CONFIG_STATUS_AT_TIME_US);
    status->source = wire[CONFIG_STATUS_AT_SOURCE];
    status->cause = wire[CONFIG_STATUS_AT_CAUSE];
    return 1;
}

int store_status_decode(const uint8_t wire[STORE_STATUS_SIZE], store_status_t *status)
{
    if (wire[0] != STORE_STATUS_VERSION)
        return 0;
    status->result = wire[STORE_STATUS_AT_RESULT];
    status->operation = wire[STORE_STATUS_AT_OPERATION];
    status->slot = wire[STORE_STATUS_AT_SLOT];
    status->bytes = be_get32(wire + STORE_STATUS_AT_BYTES);
    status->default_slot = wire[STORE_STATUS_AT_DEFAULT];
    status->golden_slot = wire[STORE_STATUS_AT_GOLDEN];
    return 1;
}
