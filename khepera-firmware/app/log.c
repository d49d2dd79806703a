#include "app/log.h"

#include <stddef.h>

static const char *const module_names[] = {"system",  "motion",  "turret",
                                           "sensors", "console", "soccer"};
static const char *const level_names[] = {"off", "error", "warn", "info", "debug"};

/* One name for each. */
typedef char
    modules_named[sizeof module_names / sizeof module_names[0] == LOG_MODULE_COUNT ? 1 : -1];
typedef char levels_named[sizeof level_names / sizeof level_names[0] == LOG_LEVEL_COUNT ? 1 : -1];

void log_init(log_t *log)
{
    unsigned i;

    log->written = 0;
    log->shown = 0;
    log->time_ms = 0;
    for (i = 0; i < LOG_MODULE_COUNT; i++)
        log->level[i] = LOG_INFO;
}

void log_write(log_t *log, log_module_t module, log_level_t level, const char *format, ...)
{
    log_line_t *line = &log->lines[log->written % LOG_LINES];
    va_list arguments;
    text_t text;

    if (level > log->level[module])
        return;
    line->time_ms = log->time_ms;
    line->module = (uint8_t)module;
    line->level = (uint8_t)level;
    text_begin(&text, line->text, sizeof line->text);
    va_start(arguments, format);
    text_add_arguments(&text, format, arguments);
    va_end(arguments);
    log->written++;
}

const log_line_t *log_line(const log_t *log, uint32_t number)
{
    if (log->written - number - 1u >= LOG_LINES)
        return NULL;
    return &log->lines[number % LOG_LINES];
}

const char *log_module_name(log_module_t module)
{
    return module_names[module];
}

const char *log_level_name(log_level_t level)
{
    return level_names[level];
}
