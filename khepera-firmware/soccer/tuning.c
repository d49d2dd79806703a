#include "soccer/tuning.h"

#define NORMAL(name, unit, normal, min, max, text) normal,
const soccer_tuning_t soccer_tuning_default = {SOCCER_TUNING(NORMAL)};
#undef NORMAL

/* A default outside its own limits does not compile. */
#define CHECK(name, unit, normal, min, max, text)                                                  \
    typedef char name##_in_range[(normal) >= (min) && (normal) <= (max) ? 1 : -1];
SOCCER_TUNING(CHECK)
