#include "app/telemetry.h"

#include <stddef.h>

#include "app/robot.h"

/* X(name, text, value): `robot` is at hand. */
/* clang-format off */
#define VARIABLES(X) \
    X("pose.x_mm", "odometry since `pose clear`, or of play", robot_pose(robot).x_mm) \
    X("pose.y_mm", "", robot_pose(robot).y_mm) \
    X("pose.heading_deg10", "0.1 degrees, left positive", robot_pose(robot).heading_deg10) \
    X("left.count", "position counter", robot->motion.position[0]) \
    X("right.count", "", robot->motion.position[1]) \
    X("left.speed_mm_s", "measured in the last 10 ms", motion_measured_mm_s(&robot->motion, 0)) \
    X("right.speed_mm_s", "", motion_measured_mm_s(&robot->motion, 1)) \
    X("left.set_mm_s", "what the controller wants", motion_set_mm_s(&robot->motion, 0)) \
    X("right.set_mm_s", "", motion_set_mm_s(&robot->motion, 1)) \
    X("left.duty", "-255..255", robot->motion.wheel[0].duty) \
    X("right.duty", "", robot->motion.wheel[1].duty) \
    X("left.error", "counts, or counts per 10 ms, as of K", wheel_error(&robot->motion.wheel[0])) \
    X("right.error", "", wheel_error(&robot->motion.wheel[1])) \
    X("ir.0", "proximity 0..1023, left; on to ir.7 as of N", robot->sensors.input[0]) \
    X("ir.1", "", robot->sensors.input[1]) \
    X("ir.2", "", robot->sensors.input[2]) \
    X("ir.3", "", robot->sensors.input[3]) \
    X("ir.4", "", robot->sensors.input[4]) \
    X("ir.5", "", robot->sensors.input[5]) \
    X("ir.6", "", robot->sensors.input[6]) \
    X("ir.7", "", robot->sensors.input[7]) \
    X("battery_mv", "", robot_battery_mv(robot)) \
    X("load_percent", "of the CPU, in the last second", robot->tasks.load_percent) \
    X("control_us", "last 10 ms task", TASK_US(robot->tasks.task[TASK_CONTROL].last_fine)) \
    X("reports", "good vision reports", (int32_t)robot->reports) \
    X("ball.x_q4", "right image, 1/16 px; of the last report", robot->report.ball_x_q4) \
    X("ball.disparity_q4", "", robot->report.ball_disparity_q4) \
    X("ball.confidence", "0..255", robot->report.ball_confidence) \
    X("state", "of the strategy; -1 = not playing", robot->playing ? (int32_t)robot->soccer.strategy.state : -1)
/* clang-format on */

static const struct {
    const char *name;
    const char *text;
} table[] = {
#define ENTRY(name, text, value) {name, text},
    VARIABLES(ENTRY)
#undef ENTRY
};

#define COUNT           (sizeof table / sizeof table[0])
/* A sign, ten digits and a comma. */
#define VALUE_SIZE      12u
#define LINE_FRAME_SIZE 13u

const char *telemetry_name(unsigned index)
{
    return index < COUNT ? table[index].name : NULL;
}

const char *telemetry_text(unsigned index)
{
    return index < COUNT ? table[index].text : NULL;
}

int32_t telemetry_value(const robot_t *robot, unsigned index)
{
    unsigned number = 0;

#define VALUE(name, text, value)                                                                   \
    if (number++ == index)                                                                         \
        return (value);
    VARIABLES(VALUE)
#undef VALUE
    return 0;
}

uint32_t telemetry_line_size(const telemetry_t *telemetry)
{
    return LINE_FRAME_SIZE + telemetry->count * VALUE_SIZE;
}
