/* What happened: a ring of the newest lines, by module and level.
 *
 * Every module has a level; what is less urgent is not kept. Lines are shown by `log show`, and, if
 * asked for (`log live on`, or an interactive console), printed as they come. */
#ifndef APP_LOG_H
#define APP_LOG_H

#include <stdint.h>

#include "app/format.h"

#define LOG_LINES     64u
#define LOG_TEXT_SIZE 64u

typedef enum { LOG_OFF, LOG_ERROR, LOG_WARN, LOG_INFO, LOG_DEBUG, LOG_LEVEL_COUNT } log_level_t;

typedef enum {
    LOG_SYSTEM,
    LOG_MOTION,
    LOG_TURRET,
    LOG_SENSORS,
    LOG_CONSOLE,
    LOG_SOCCER,
    LOG_MODULE_COUNT
} log_module_t;

typedef struct {
    uint32_t time_ms;
    uint8_t module;
    uint8_t level;
    char text[LOG_TEXT_SIZE];
} log_line_t;

typedef struct {
    log_line_t lines[LOG_LINES];
    uint32_t written; /* lines since start; the ring holds the last LOG_LINES */
    uint32_t shown;   /* ... of which so many have been printed live or passed over */
    uint8_t level[LOG_MODULE_COUNT];
    uint32_t time_ms; /* of new lines: the owner keeps it up */
} log_t;

/* Empty, all modules at LOG_INFO. */
void log_init(log_t *log);

void log_write(log_t *log, log_module_t module, log_level_t level, const char *format, ...)
    FORMAT_LIKE_PRINTF(4, 5);

/* The line number `number` (counted as log_t.written), or NULL if the ring has lost it or it is not
 * there yet. */
const log_line_t *log_line(const log_t *log, uint32_t number);

const char *log_module_name(log_module_t module);
const char *log_level_name(log_level_t level);

#endif
