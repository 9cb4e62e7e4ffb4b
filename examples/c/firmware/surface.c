#include "surface.h"

#include <stdalign.h>
#include <stdint.h>

#include "must.h"

/* Ticks of the control loop a second: a tick is a millisecond. */
#define TICK_RATE 1000u

/* From tree.S. */
extern const uint8_t tree_bytes[], tree_end[];

/* Limits in ms, the first degraded and the second safe. The emulated line takes one to three seconds for a frame; those
   of a real bus, which brings tens of frames a second, are some tens of milliseconds. */
static const dibs_limits trust = {
    .age = {4000, 6000},
    .silence = {1000, 2000},
    .heartbeat = {1000, 3000},
    .rejections = {10, 30},
    .transit = {500, 1000},
    .source_age = {1000, 2000},
    .forgeries = {0, 100},
    .tissue_speed = 0.001f,
    .recovery_frames = 1,
    .dwell = TICK_RATE / 5,
};

static const dibs_guard_limits limits = {
    /* Twice the largest speed of the generated heart. */
    .speed = 100.0f,
    .age = 6000,
    .ticks_a_second = TICK_RATE,
    /* The budget exceeds the needs of the closest pair on the heart, and fits in a tick on every admitted surface. The
       tolerance changes the spring's force by a quarter of a newton. */
    .options = {.budget = 1750, .depth_tolerance = 0.25f},
    /* Nobody acknowledges here; leave this out for a real robot. */
    .automatic = 1,
    .trust = &trust,
};

static alignas(DIBS_ALIGNMENT) uint8_t tree_memory[DIBS_TREE_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t surface_memory[DIBS_GUARDED_SIZE(SURFACE_VERTICES)];

static dibs_tree *tree;
static dibs_surface *surface;
static dibs_vec3 centre;
static float reach;

static void include(float at, float *low, float *high) {
    *low = at < *low ? at : *low;
    *high = at > *high ? at : *high;
}

/* Computes the bounding box of the rest shape, so that no dimension of the mesh has to be written here. */
static void measure(uint32_t vertices) {
    dibs_vec3 low, high;
    must(dibs_tree_rest_position(tree, 0, &low));
    high = low;
    for (uint32_t row = 1; row < vertices; row++) {
        dibs_vec3 at;
        must(dibs_tree_rest_position(tree, row, &at));
        include(at.x, &low.x, &high.x);
        include(at.y, &low.y, &high.y);
        include(at.z, &low.z, &high.z);
    }
    centre = (dibs_vec3){(low.x + high.x) / 2.0f, (low.y + high.y) / 2.0f, (low.z + high.z) / 2.0f};
    reach = high.x - low.x;
    reach = high.y - low.y > reach ? high.y - low.y : reach;
    reach = high.z - low.z > reach ? high.z - low.z : reach;
    reach /= 2.0f;
}

void surface_init(void) {
    dibs_tree_facts facts;
    const size_t bytes = (uintptr_t)tree_end - (uintptr_t)tree_bytes;
    must(dibs_tree_init(tree_memory, sizeof tree_memory, tree_bytes, bytes, &tree));
    must(dibs_tree_get_facts(tree, &facts));
    must(facts.vertices == SURFACE_VERTICES ? DIBS_CODE_OK : DIBS_CODE_VERTEX_COUNT);
    measure(facts.vertices);
    must(dibs_surface_init(surface_memory, sizeof surface_memory, facts.vertices, &surface));
}

dibs_tree *surface_tree(void) {
    return tree;
}

dibs_surface *surface_buffers(void) {
    return surface;
}

const dibs_guard_limits *surface_limits(void) {
    return &limits;
}

dibs_vec3 surface_centre(void) {
    return centre;
}

float surface_reach(void) {
    return reach;
}
