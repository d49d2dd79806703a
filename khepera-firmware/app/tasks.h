/* How long each part of the main loop takes, and how much time is left. */
#ifndef APP_TASKS_H
#define APP_TASKS_H

#include <stdint.h>

typedef enum {
    TASK_CONTROL, /* the 10 ms tick: odometry, decision, wheels */
    TASK_REPORT,  /* a vision report */
    TASK_CONSOLE, /* characters and commands */
    TASK_COUNT
} task_t;

typedef struct {
    uint32_t runs;
    uint16_t last_fine; /* units of base_t.fine, 10 us */
    uint16_t worst_fine;
} task_times_t;

typedef struct {
    task_times_t task[TASK_COUNT];
    uint32_t late_ticks;  /* ticks that came before the one before was done */
    uint32_t idle_fine;   /* asleep in the present second */
    uint16_t mark_fine;   /* when the last tick came */
    uint32_t second_fine; /* length of the present second so far */
    uint8_t load_percent; /* of the last whole second, interrupts included where they hit */
} tasks_t;

void tasks_init(tasks_t *tasks, uint16_t now_fine);

/* A task ran from `begin_fine` to `end_fine`. */
void tasks_ran(tasks_t *tasks, task_t task, uint16_t begin_fine, uint16_t end_fine);

/* The main loop has slept from `begin_fine` to `end_fine`. */
static inline void tasks_slept(tasks_t *tasks, uint16_t begin_fine, uint16_t end_fine)
{
    tasks->idle_fine += (uint16_t)(end_fine - begin_fine);
}

/* Forget the worst times. */
void tasks_clear(tasks_t *tasks);

const char *task_name(task_t task);

#endif
