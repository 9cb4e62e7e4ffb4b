#include "upkeep.h"

#include <dibs.h>
#include <stdalign.h>
#include <stdatomic.h>

#include "must.h"
#include "surface.h"

/* Bytes of one slice: some thousand instructions. */
#define SLICE 256u

static alignas(DIBS_ALIGNMENT) uint8_t scrub_memory[DIBS_SCRUB_SIZE];
static dibs_scrub *scrub;
static atomic_bool is_tree_corrupt;
/* Bytes checked in this round, and rounds finished. */
static uint32_t checked;
static uint32_t rounds;

void upkeep_init(void) {
    must(dibs_scrub_init(scrub_memory, sizeof scrub_memory, surface_tree(), &scrub));
}

void upkeep_step(void) {
    if (dibs_scrub_step(scrub, SLICE) != DIBS_CODE_OK) {
        atomic_store_explicit(&is_tree_corrupt, true, memory_order_relaxed);
    }
    checked += SLICE;
    if (checked >= surface_bytes()) {
        checked = 0;
        rounds++;
    }
}

uint32_t upkeep_rounds(void) {
    return rounds;
}

bool upkeep_is_tree_corrupt(void) {
    return atomic_load_explicit(&is_tree_corrupt, memory_order_relaxed);
}
