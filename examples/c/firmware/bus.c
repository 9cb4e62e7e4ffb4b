#include "bus.h"

#include <stdalign.h>
#include <stdatomic.h>

#include "fingerprint.h"
#include "must.h"
#include "surface.h"

/* Ticks between two statuses, unless a frame was published or refused before. */
#define REPORT_INTERVAL 100u
/* Limit on the coordinates, as a multiple of the rest shape's size. */
#define ROOM 4.0f
/* Limit on a vertex's speed, in mm a tick: twice the generated heart's. */
#define SPEED 0.1f
/* Least size of a region as a part of its size at rest. */
#define SHRINKAGE 0.25f
/* Rows and triangles that one slice checks or copies. */
#define WORK 32u
/* The first of the events that are rejections: docs/wire.md. */
#define FIRST_REJECTION 4u
/* A status without a state. */
#define NOT_REPORTED 0u

static alignas(DIBS_ALIGNMENT) uint8_t receiver_memory[DIBS_RECEIVER_SIZE];
static dibs_receiver *receiver;

/* Tick of the last status, and whether a frame was published or refused since. */
static uint32_t reported;
static bool has_news;

/* Words between the contexts. */
static atomic_uint_least32_t bytes, published, rejected, safety = NOT_REPORTED;

static float largest_coordinate(dibs_vec3 at) {
    float largest = at.x < 0.0f ? -at.x : at.x;
    const float y = at.y < 0.0f ? -at.y : at.y;
    const float z = at.z < 0.0f ? -at.z : at.z;
    largest = y > largest ? y : largest;
    return z > largest ? z : largest;
}

void bus_init(void) {
    const dibs_surface_limits limits = {
        .reach = largest_coordinate(surface_centre()) + ROOM * surface_reach(),
        .speed = SPEED,
        .shrinkage = SHRINKAGE,
    };
    must(dibs_receiver_init(receiver_memory, sizeof receiver_memory, surface_buffers(), surface_tree(), &limits, &receiver));
}

static void count(void) {
    uint32_t events[DIBS_EVENTS];
    bus_events(events);
    uint32_t sum = 0;
    for (size_t event = FIRST_REJECTION; event < DIBS_EVENTS; event++) {
        sum += events[event];
    }
    atomic_store_explicit(&published, events[0], memory_order_relaxed);
    atomic_store_explicit(&rejected, sum, memory_order_relaxed);
}

void bus_byte(uint8_t byte, uint32_t tick) {
    dibs_progress progress = DIBS_PROGRESS_NONE;
    atomic_fetch_add_explicit(&bytes, 1, memory_order_relaxed);
    /* A rejection is counted by its cause in the receiver. */
    const dibs_code code = dibs_receiver_byte(receiver, byte, tick, &progress);
    if (code != DIBS_CODE_OK || progress != DIBS_PROGRESS_NONE) {
        has_news = has_news || progress == DIBS_PROGRESS_HELLO;
        count();
    }
}

void bus_work(void) {
    dibs_advance advance = DIBS_ADVANCE_IDLE;
    const dibs_code code = dibs_receiver_advance(receiver, WORK, &advance);
    if (code == DIBS_CODE_OK && advance == DIBS_ADVANCE_PENDING) {
        return;
    }
    if (code == DIBS_CODE_OK && advance != DIBS_ADVANCE_PUBLISHED) {
        /* The published frame is read in full while the next one arrives. */
        fingerprint_step(receiver);
        return;
    }
    if (code == DIBS_CODE_OK) {
        fingerprint_begin(receiver);
    }
    has_news = true;
    count();
}

size_t bus_report(uint32_t tick, uint8_t out[DIBS_STATUS]) {
    if (!has_news && tick - reported < REPORT_INTERVAL) {
        return 0;
    }
    reported = tick;
    has_news = false;
    const uint8_t state = (uint8_t)atomic_load_explicit(&safety, memory_order_relaxed);
    size_t length;
    must(dibs_receiver_status(receiver, tick, state, 1, out, DIBS_STATUS, &length));
    return length;
}

void bus_events(uint32_t events[DIBS_EVENTS]) {
    must(dibs_receiver_counters(receiver, events));
}

bus_counts bus_seen(void) {
    bus_counts seen = {
        .bytes = atomic_load_explicit(&bytes, memory_order_relaxed),
        .published = atomic_load_explicit(&published, memory_order_relaxed),
        .rejected = atomic_load_explicit(&rejected, memory_order_relaxed),
    };
    fingerprint_last(&seen.read_epoch, &seen.read_digest);
    return seen;
}

void bus_set_state(uint32_t state) {
    atomic_store_explicit(&safety, state + 1, memory_order_relaxed);
}
