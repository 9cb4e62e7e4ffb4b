#include "queue.h"

#include <stdatomic.h>

/* A power of two, because the counts of records wrap. */
#define CAPACITY 64u

static tick_record records[CAPACITY];
/* Numbers of records added and taken. Each is written by one context. */
static atomic_uint added, taken;

bool queue_add(const tick_record *record) {
    const unsigned next = atomic_load_explicit(&added, memory_order_relaxed);
    if (next - atomic_load_explicit(&taken, memory_order_acquire) == CAPACITY) {
        return false;
    }
    records[next % CAPACITY] = *record;
    atomic_store_explicit(&added, next + 1, memory_order_release);
    return true;
}

bool queue_take(tick_record *record) {
    const unsigned next = atomic_load_explicit(&taken, memory_order_relaxed);
    if (next == atomic_load_explicit(&added, memory_order_acquire)) {
        return false;
    }
    *record = records[next % CAPACITY];
    atomic_store_explicit(&taken, next + 1, memory_order_release);
    return true;
}
