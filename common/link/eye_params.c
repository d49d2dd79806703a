#include "link/registers.h"

const eye_params_t eye_params_default = {
#define DEFAULT(address, name, unit, reset, min, max, text) reset,
    EYE_PARAMS(DEFAULT)
#undef DEFAULT
};

void eye_params_encode(const eye_params_t *params, uint8_t bytes[EYE_PARAM_COUNT])
{
#define ENCODE(address, name, unit, reset, min, max, text) *bytes++ = params->name;
    EYE_PARAMS(ENCODE)
#undef ENCODE
}

void eye_params_decode(const uint8_t bytes[EYE_PARAM_COUNT], eye_params_t *params)
{
#define DECODE(address, name, unit, reset, min, max, text) params->name = *bytes++;
    EYE_PARAMS(DECODE)
#undef DECODE
}

static uint8_t clamped(uint8_t value, uint8_t min, uint8_t max)
{
    if (value < min)
        return min;
    return value > max ? max : value;
}

void eye_params_clamp(eye_params_t *params)
{
#define CLAMP(address, name, unit, reset, min, max, text)                                          \
    params->name = clamped(params->name, min, max);
    EYE_PARAMS(CLAMP)
#undef CLAMP
}
