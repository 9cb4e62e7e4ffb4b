#include "surface.h"

#include <stdalign.h>
#include <stdint.h>

#include "must.h"

/* Of tree.S. */
extern const uint8_t tree_bytes[], tree_end[];

static alignas(DIBS_ALIGNMENT) uint8_t tree_memory[DIBS_TREE_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t surface_memory[DIBS_SURFACE_SIZE(SURFACE_VERTICES)];

static dibs_tree *tree;
static dibs_surface *surface;
static dibs_vec3 centre;
static float reach;

static void include(float at, float *low, float *high) {
    *low = at < *low ? at : *low;
    *high = at > *high ? at : *high;
}

/* Reads the rest shape once, so that no figure of the mesh has to be written here by hand. */
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
    must(dibs_tree_init(tree_memory, sizeof tree_memory, tree_bytes, surface_bytes(), &tree));
    must(dibs_tree_get_facts(tree, &facts));
    must(facts.vertices == SURFACE_VERTICES ? DIBS_CODE_OK : DIBS_CODE_VERTEX_COUNT);
    measure(facts.vertices);
    must(dibs_surface_init(surface_memory, sizeof surface_memory, facts.vertices, &surface));
}

dibs_tree *surface_tree(void) {
    return tree;
}

uint32_t surface_bytes(void) {
    return (uint32_t)((uintptr_t)tree_end - (uintptr_t)tree_bytes);
}

dibs_surface *surface_buffers(void) {
    return surface;
}

dibs_vec3 surface_centre(void) {
    return centre;
}

float surface_reach(void) {
    return reach;
}
