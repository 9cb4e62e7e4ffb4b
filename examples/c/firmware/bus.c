#include "bus.h"

#include <stdalign.h>
#include <stdatomic.h>

#include "fingerprint.h"
#include "must.h"
#include "surface.h"

/* Rows and triangles that one slice checks or copies. */
#define WORK 32u
/* Index of the first event that is a rejection: docs/wire.md. */
#define FIRST_REJECTION 4u

static alignas(DIBS_ALIGNMENT) uint8_t bus_memory[DIBS_BUS_SIZE];
static dibs_bus *bus;

/* Words shared by the contexts. */
static atomic_uint_least32_t bytes, published, rejected;

void bus_init(void) {
    must(dibs_bus_init(bus_memory, sizeof bus_memory, surface_buffers(), surface_tree(), surface_limits(), &bus));
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
    atomic_fetch_add_explicit(&bytes, 1, memory_order_relaxed);
    must(dibs_bus_receive(bus, &byte, 1, tick));
}

void bus_work(void) {
    dibs_advance advance = DIBS_ADVANCE_IDLE;
    /* The code is not needed: a rejection is counted by its cause. */
    const dibs_code code = dibs_bus_work(bus, WORK, &advance);
    if (code == DIBS_CODE_OK && advance == DIBS_ADVANCE_PUBLISHED) {
        fingerprint_begin(bus);
    } else if (code == DIBS_CODE_OK && advance != DIBS_ADVANCE_PENDING) {
        /* The published frame is read completely while the next one arrives. */
        fingerprint_step(bus);
    }
    count();
}

size_t bus_report(uint32_t tick, uint8_t out[DIBS_STATUS]) {
    size_t length;
    must(dibs_bus_status(bus, tick, 1, out, DIBS_STATUS, &length));
    return length;
}

void bus_events(uint32_t events[DIBS_EVENTS]) {
    must(dibs_bus_counters(bus, events));
}

uint32_t bus_rounds(void) {
    dibs_bus_facts facts;
    must(dibs_bus_get_facts(bus, &facts));
    return facts.rounds;
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
