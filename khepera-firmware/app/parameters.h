/* Everything that can be tuned, with names, units and ranges.
 *
 * The list below and soccer/tuning.h are its only places: structure, defaults, console and flash
 * follow from them. A changed value acts at once, and until the next reset; `save` keeps it
 * (app/parameter_store.h). */
#ifndef APP_PARAMETERS_H
#define APP_PARAMETERS_H

#include <stdint.h>

#include "app/motion.h"
#include "board/khepera.h"
#include "soccer/tuning.h"

/* X(name, field of parameters_t, unit, default, min, max, text) */
/* clang-format off */
#define BASE_PARAMETERS(X) \
    X("speed.kp", motion.wheel.speed.p, "", 3800, 0, 32767, "speed control, proportional (A)") \
    X("speed.ki", motion.wheel.speed.i, "", 800, 0, 32767, "speed control, integral (A)") \
    X("speed.kd", motion.wheel.speed.d, "", 100, 0, 32767, "speed control, differential (A)") \
    X("speed.ramp_mm_s2", motion.speed_ramp_mm_s2, "mm/s2", 5000, 100, 20000, "acceleration of D") \
    X("position.kp", motion.wheel.position.p, "", 3000, 0, 32767, "position control, proportional (F)") \
    X("position.ki", motion.wheel.position.i, "", 20, 0, 32767, "position control, integral (F)") \
    X("position.kd", motion.wheel.position.d, "", 4000, 0, 32767, "position control, differential (F)") \
    X("position.tolerance", motion.wheel.tolerance, "counts", 2, 0, 100, "so near is on target") \
    X("profile.speed_left", motion.profile_speed[0], "counts/10ms", 20, 1, 127, "top speed of C (J)") \
    X("profile.speed_right", motion.profile_speed[1], "counts/10ms", 20, 1, 127, "top speed of C (J)") \
    X("profile.accel_left", motion.profile_acceleration[0], "counts/256/10ms2", 64, 1, 255, "acceleration of C (J)") \
    X("profile.accel_right", motion.profile_acceleration[1], "counts/256/10ms2", 64, 1, 255, "acceleration of C (J)") \
    X("drive.ramp_mm_s2", motion.drive_ramp_mm_s2, "mm/s2", 1500, 100, 20000, "acceleration of soccer") \
    X("motor.top_mm_s", motion.wheel.top_mm_s, "mm/s", 1000, 200, 3000, "speed at full duty") \
    X("motor.friction", motion.wheel.friction, "duty", 6, 0, 60, "duty that friction eats") \
    X("motor.current_percent", motion.wheel.current_percent, "%", 60, 10, 100, "of the stall current, at most") \
    X("battery.low_mv", battery_low_mv, "mV", 4000, 0, 10000, "warn below") \
    X("serial.baud", serial_baud, "baud", BOARD_BAUD, 9600, 115200, "after a reset: 9600, 19200, 38400 or 115200")
/* clang-format on */

typedef struct {
    motion_settings_t motion;
    int32_t battery_low_mv;
    int32_t serial_baud;
    soccer_tuning_t soccer;
} parameters_t;

/* One of them. */
typedef struct {
    const char *name; /* soccer's begin with "soccer." */
    const char *unit;
    const char *text;
    int32_t initial, min, max;
    uint16_t offset; /* in parameters_t */
    uint8_t size;    /* bytes of the field, 2 or 4 */
} parameter_t;

#define PARAMETER_NONE UINT16_MAX

uint16_t parameter_count(void);
/* Number `index` < parameter_count(). */
const parameter_t *parameter_at(uint16_t index);
/* The one with this name, or PARAMETER_NONE. */
uint16_t parameter_find(const char *name);

/* All defaults. */
void parameters_default(parameters_t *parameters);

int32_t parameter_get(const parameters_t *parameters, uint16_t index);
/* 1, or 0 if the value is out of range (nothing changes). */
int parameter_set(parameters_t *parameters, uint16_t index, int32_t value);

/* 1 if the serial line can be set to it. */
int parameter_baud_possible(int32_t baud);

#endif
