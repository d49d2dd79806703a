#include "app/tasks.h"

#include "app/base.h"

static const char *const names[] = {"control", "report", "console"};

typedef char tasks_named[sizeof names / sizeof names[0] == TASK_COUNT ? 1 : -1];

void tasks_init(tasks_t *tasks, uint16_t now_fine)
{
    unsigned i;

    for (i = 0; i < TASK_COUNT; i++)
        tasks->task[i].runs = 0;
    tasks->idle_fine = 0;
    tasks->second_fine = 0;
    tasks->mark_fine = now_fine;
    tasks->load_percent = 0;
    tasks_clear(tasks);
}

static void end_second(tasks_t *tasks)
{
    uint32_t idle_percent = tasks->idle_fine / (tasks->second_fine / 100u);

    tasks->load_percent = (uint8_t)(idle_percent > 100u ? 0u : 100u - idle_percent);
    tasks->idle_fine = 0;
    tasks->second_fine = 0;
}

static void count_tick(tasks_t *tasks, uint16_t now_fine)
{
    tasks->second_fine += (uint16_t)(now_fine - tasks->mark_fine);
    tasks->mark_fine = now_fine;
    if (tasks->second_fine >= BASE_FINE_HZ)
        end_second(tasks);
}

void tasks_ran(tasks_t *tasks, task_t task, uint16_t begin_fine, uint16_t end_fine)
{
    task_times_t *times = &tasks->task[task];

    times->runs++;
    times->last_fine = (uint16_t)(end_fine - begin_fine);
    if (times->last_fine > times->worst_fine)
        times->worst_fine = times->last_fine;
    if (task == TASK_CONTROL)
        count_tick(tasks, begin_fine);
}

void tasks_clear(tasks_t *tasks)
{
    unsigned i;

    for (i = 0; i < TASK_COUNT; i++) {
        tasks->task[i].last_fine = 0;
        tasks->task[i].worst_fine = 0;
    }
    tasks->late_ticks = 0;
}

const char *task_name(task_t task)
{
    return names[task];
}
