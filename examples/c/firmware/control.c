#include "control.h"

#include <float.h>
#include <stdalign.h>

#include "bus.h"
#include "clock.h"
#include "instrument.h"
#include "must.h"
#include "surface.h"

static const dibs_wall wall = {.stiffness = 1.0f, .damping = 0.002f, .max_force = 5.0f, .margin = 5.0f};

static alignas(DIBS_ALIGNMENT) uint8_t guard_memory[DIBS_GUARD_SIZE];
static dibs_guard *guard;
static uint32_t tick;

void control_init(void) {
    must(dibs_guard_init(guard_memory, sizeof guard_memory, surface_buffers(), surface_tree(), surface_limits(), &guard));
}

static void write_tool(const dibs_tool *tool, tick_record *record) {
    record->tool_start = tool->start;
    record->tool_end = tool->end;
    record->tool_radius = tool->radius;
}

static void write_bus(tick_record *record) {
    const bus_counts counts = bus_seen();
    record->bytes = counts.bytes;
    record->frames_published = counts.published;
    record->rejected = counts.rejected;
    record->read_epoch = counts.read_epoch;
    record->read_digest = counts.read_digest;
}

/* Writes the searched surface, and the pair on it. */
static void write_searched(const dibs_searched_surface *searched, tick_record *record) {
    const dibs_proximity *found = &searched->tracked.proximity;
    record->epoch_before = searched->before;
    record->blend = searched->t;
    record->residual = searched->residual;
    record->position_error = searched->position_error;
    record->surface_velocity = searched->velocity;
    record->answered = searched->outcome == DIBS_CODE_OK;
    if (record->answered) {
        record->separation = found->separation;
        record->lower = found->lower;
        record->accuracy = found->accuracy;
        record->point_on_surface = found->point_on_surface;
        record->axis_parameter = found->axis_parameter;
        record->direction = found->direction;
        record->triangle = found->triangle;
        record->node_tests = found->node_tests;
        record->triangle_tests = found->triangle_tests;
        record->front = searched->tracked.opened;
        record->fallback = searched->tracked.fallback;
    }
}

void control_tick(tick_record *record) {
    const dibs_tool tool = instrument(tick);
    dibs_answer answer;
    dibs_force force;
    const uint32_t start = clock_now();
    must(dibs_guard_closest(guard, &tool, tick, &answer));
    const uint32_t took = clock_now() - start;
    must(dibs_answer_force(&answer, &wall, &force));

    *record = (tick_record){
        .kind = TICK_KIND,
        .tick = tick,
        .state = answer.trust.state,
        .cause = telemetry_cause(answer.trust.cause),
        .margin = answer.trust.margin,
        .silence = answer.link.silence,
        .epoch = answer.age.epoch,
        .age = answer.age.is_published ? answer.age.age : UINT32_MAX,
        .triangle = DIBS_NO_TRIANGLE,
        .force = force.force,
        .query_counts = took,
        /* This controller lists no contacts. */
        .contacts_bound = -FLT_MAX,
    };
    write_tool(&tool, record);
    write_bus(record);
    write_searched(&answer.searched, record);
    tick++;
}
