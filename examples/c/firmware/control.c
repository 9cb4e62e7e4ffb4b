#include "control.h"

#include <stdalign.h>
#include <stdbool.h>

#include "bus.h"
#include "clock.h"
#include "instrument.h"
#include "must.h"
#include "surface.h"
#include "upkeep.h"

/* Control ticks a second. */
#define TICK_RATE 1000u
/* More than the closest pair on the heart needs, and within a tick on every admitted surface. The spring tells depths
   of a quarter of a millimetre apart. */
static const dibs_options options = {.budget = 2000,
                                     .depth_tolerance = 0.25f};

/* Limits in ms, the first degraded and the second safe. The emulated line takes one to three seconds for a frame; those
   of a real bus, which brings tens of frames a second, are some tens of milliseconds. */
static const dibs_limits limits = {
    .age = {4 * TICK_RATE, 6 * TICK_RATE},
    .silence = {TICK_RATE, 2 * TICK_RATE},
    .heartbeat = {TICK_RATE, 3 * TICK_RATE},
    .rejections = {10, 30},
    .transit = {TICK_RATE / 2, TICK_RATE},
    .source_age = {TICK_RATE, 2 * TICK_RATE},
    .forgeries = {0, 100},
    .tissue_speed = 0.001f,
    .recovery_frames = 1,
    .dwell = TICK_RATE / 5,
    /* Nobody acknowledges here; a real robot leaves this out. */
    .automatic = 1,
};

static const dibs_wall wall = {
    .stiffness = 1.0f, .damping = 0.002f, .hold_damping = 0.002f, .max_force = 5.0f, .margin = 5.0f};

static alignas(DIBS_ALIGNMENT) uint8_t tracker_memory[DIBS_TRACKER_SIZE(0)];
static alignas(DIBS_ALIGNMENT) uint8_t reader_memory[DIBS_READER_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t frame_memory[DIBS_FRAME_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t failsafe_memory[DIBS_FAILSAFE_SIZE];

static dibs_tracker *tracker;
static dibs_reader *reader;
static dibs_frame *frame;
static dibs_failsafe *failsafe;

static uint32_t tick;
/* The last tick's instrument, for its velocity. */
static dibs_tool before;

void control_init(void) {
    must(dibs_tracker_init(tracker_memory, sizeof tracker_memory, surface_tree(), &tracker));
    must(dibs_reader_init(reader_memory, sizeof reader_memory, surface_buffers(), &reader));
    must(dibs_frame_init(frame_memory, sizeof frame_memory, &frame));
    must(dibs_failsafe_init(failsafe_memory, sizeof failsafe_memory, &limits, &failsafe));
    before = instrument(0);
}

static void write(const dibs_proximity *found, tick_record *record) {
    record->answered = 1;
    record->separation = found->separation;
    record->lower = found->lower;
    record->accuracy = found->accuracy;
    record->point_on_surface = found->point_on_surface;
    record->triangle = found->triangle;
    record->node_tests = found->node_tests;
    record->triangle_tests = found->triangle_tests;
}

/* The closest pair on the frame published last. What the fail-safe machine has to know goes to `seen`. */
static dibs_code ask(const dibs_tool *tool, dibs_observation *seen, dibs_proximity *found,
                     tick_record *record) {
    /* The fail-safe machine decides how old a surface may be. */
    const dibs_code held = dibs_reader_latest(reader, tick, DIBS_UNLIMITED, frame, &seen->age);
    if (held != DIBS_CODE_OK) {
        return held;
    }
    dibs_frame_facts facts;
    must(dibs_frame_get_facts(frame, &facts));
    record->epoch = seen->age.epoch;
    record->epoch_before = seen->age.epoch;
    record->blend = 1.0f;
    record->residual = -1.0f;
    record->age = seen->age.age;
    record->position_error = facts.position_error;

    const uint32_t start = clock_now();
    seen->query = dibs_tracker_closest_on(tracker, frame, tool, &options, found, &record->fallback, NULL);
    record->query_counts = clock_now() - start;
    /* Until then no frame is published. */
    must(dibs_frame_release(frame));
    if (seen->query == DIBS_CODE_OK) {
        write(found, record);
    }
    return seen->query;
}

static float along(float start, float end, float t) {
    return (start + (end - start) * t) * (float)TICK_RATE;
}

/* Velocity (mm/s) of the point at `t` of the instrument's axis, 0 at its start and 1 at its end. */
static dibs_vec3 velocity(const dibs_tool *tool, float t) {
    return (dibs_vec3){
        along(tool->start.x - before.start.x, tool->end.x - before.end.x, t),
        along(tool->start.y - before.start.y, tool->end.y - before.end.y, t),
        along(tool->start.z - before.start.z, tool->end.z - before.end.z, t),
    };
}

void control_tick(tick_record *record) {
    const dibs_tool tool = instrument(tick);
    const bus_counts counts = bus_seen();
    *record = (tick_record){
        .kind = TICK_KIND,
        .tick = tick,
        .tool_start = tool.start,
        .tool_end = tool.end,
        .tool_radius = tool.radius,
        .triangle = DIBS_NO_TRIANGLE,
        .bytes = counts.bytes,
        .frames_published = counts.published,
        .rejected = counts.rejected,
        .read_epoch = counts.read_epoch,
        .read_digest = counts.read_digest,
    };

    dibs_observation seen = {.query = DIBS_CODE_OK};
    dibs_proximity found;
    dibs_code code = ask(&tool, &seen, &found, record);
    const float t = code == DIBS_CODE_OK ? found.axis_parameter : 0.5f;

    must(dibs_reader_link(reader, tick, &seen.link));
    seen.is_tree_corrupt = upkeep_is_tree_corrupt() || dibs_tree_check(surface_tree()) != DIBS_CODE_OK;
    dibs_verdict verdict;
    must(dibs_failsafe_step(failsafe, &seen, &verdict));
    bus_set_state(verdict.state);

    if (code == DIBS_CODE_OK) {
        code = dibs_verdict_admit(&verdict, &found);
    }
    dibs_force force;
    must(dibs_wall_force(&wall, code, &found, velocity(&tool, t), &force));

    record->state = verdict.state;
    record->cause = telemetry_cause(verdict.cause, seen.is_tree_corrupt != 0);
    record->margin = verdict.margin;
    record->silence = seen.link.silence;
    record->force = force.force;
    before = tool;
    tick++;
}
