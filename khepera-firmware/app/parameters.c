#include "app/parameters.h"

#include <stddef.h>

#include "app/format.h"

#define SIZE_OF(field) ((uint8_t)sizeof(((parameters_t *)0)->field))

#define BASE_ENTRY(name, field, unit, initial, min, max, text)                                     \
    {name, unit, text, (int32_t)(initial), min, max, offsetof(parameters_t, field), SIZE_OF(field)},
#define SOCCER_ENTRY(name, unit, initial, min, max, text)                                          \
    {"soccer." #name,                                                                              \
     unit,                                                                                         \
     text,                                                                                         \
     initial,                                                                                      \
     min,                                                                                          \
     max,                                                                                          \
     (uint16_t)(offsetof(parameters_t, soccer) + offsetof(soccer_tuning_t, name)),                 \
     sizeof(((soccer_tuning_t *)0)->name)},

static const parameter_t table[] = {BASE_PARAMETERS(BASE_ENTRY) SOCCER_TUNING(SOCCER_ENTRY)};

#define COUNT ((uint16_t)(sizeof table / sizeof table[0]))

uint16_t parameter_count(void)
{
    return COUNT;
}

const parameter_t *parameter_at(uint16_t index)
{
    return &table[index];
}

uint16_t parameter_find(const char *name)
{
    uint16_t i;

    for (i = 0; i < COUNT; i++)
        if (text_equal(table[i].name, name))
            return i;
    return PARAMETER_NONE;
}

static void *field_of(parameters_t *parameters, const parameter_t *parameter)
{
    return (uint8_t *)parameters + parameter->offset;
}

static void put(parameters_t *parameters, const parameter_t *parameter, int32_t value)
{
    if (parameter->size == sizeof(int16_t))
        *(int16_t *)field_of(parameters, parameter) = (int16_t)value;
    else
        *(int32_t *)field_of(parameters, parameter) = value;
}

void parameters_default(parameters_t *parameters)
{
    uint16_t i;

    for (i = 0; i < COUNT; i++)
        put(parameters, &table[i], table[i].initial);
}

int32_t parameter_get(const parameters_t *parameters, uint16_t index)
{
    const parameter_t *parameter = &table[index];
    const void *field = (const uint8_t *)parameters + parameter->offset;

    return parameter->size == sizeof(int16_t) ? *(const int16_t *)field : *(const int32_t *)field;
}

int parameter_baud_possible(int32_t baud)
{
    return baud == 9600 || baud == 19200 || baud == 38400 || baud == 115200;
}

int parameter_set(parameters_t *parameters, uint16_t index, int32_t value)
{
    const parameter_t *parameter = &table[index];

    if (value < parameter->min || value > parameter->max)
        return 0;
    if (parameter->offset == offsetof(parameters_t, serial_baud) && !parameter_baud_possible(value))
        return 0;
    put(parameters, parameter, value);
    return 1;
}
