#include "fingerprint.h"

#include <stdatomic.h>

#include "crc.h"
#include "must.h"
#include "surface.h"

/* Rows that one slice reads. */
#define ROWS 8u

/* The frame that is being read, its checksum so far, and the next row; past the last row, none is read. */
static uint32_t reading;
static uint32_t crc;
static uint32_t next = SURFACE_VERTICES;

/* The frame that was last read completely. */
static atomic_uint_least32_t last_epoch, last_digest;

void fingerprint_begin(dibs_bus *bus) {
    dibs_bus_facts facts;
    must(dibs_bus_get_facts(bus, &facts));
    reading = facts.epoch;
    crc = CRC_START;
    next = 0;
}

void fingerprint_step(dibs_bus *bus) {
    if (next >= SURFACE_VERTICES) {
        return;
    }
    for (uint32_t row = 0; row < ROWS && next < SURFACE_VERTICES; row++, next++) {
        dibs_vec3 at;
        must(dibs_bus_position(bus, next, &at));
        crc = crc_take(crc, &at, sizeof at);
    }
    if (next >= SURFACE_VERTICES) {
        /* The epoch is 0 while the two change, so that a tick in between uses neither. */
        atomic_store_explicit(&last_epoch, 0, memory_order_relaxed);
        atomic_store_explicit(&last_digest, crc_end(crc), memory_order_release);
        atomic_store_explicit(&last_epoch, reading, memory_order_release);
    }
}

void fingerprint_last(uint32_t *epoch, uint32_t *digest) {
    *epoch = atomic_load_explicit(&last_epoch, memory_order_acquire);
    *digest = atomic_load_explicit(&last_digest, memory_order_acquire);
    if (*epoch != atomic_load_explicit(&last_epoch, memory_order_relaxed)) {
        *epoch = 0;
        *digest = 0;
    }
}
