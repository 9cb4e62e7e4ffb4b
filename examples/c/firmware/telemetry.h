/*
 * The controller's records for the host: one a tick, and a summary at the end.
 *
 * A record is its fields in order, little-endian, 32 bits each, then a CRC-32 of them, framed with COBS and a zero byte.
 * firmware-example/src/telemetry.rs says what each field means.
 */
#ifndef TELEMETRY_H
#define TELEMETRY_H

#include <dibs.h>
#include <stddef.h>
#include <stdint.h>

/* One control tick. */
typedef struct {
    uint32_t kind;
    uint32_t tick;
    uint32_t state;
    uint32_t cause;
    uint32_t answered;
    float margin;
    uint32_t epoch;
    uint32_t age;
    float position_error;
    dibs_vec3 tool_start;
    dibs_vec3 tool_end;
    float tool_radius;
    float separation;
    float lower;
    float accuracy;
    dibs_vec3 point_on_surface;
    float axis_parameter;
    dibs_vec3 direction;
    uint32_t triangle;
    uint32_t node_tests;
    uint32_t triangle_tests;
    dibs_vec3 force;
    uint32_t query_counts;
    uint32_t bytes;
    uint32_t silence;
    uint32_t frames_published;
    uint32_t rejected;
    uint32_t read_epoch;
    uint32_t read_digest;
    uint32_t front;
    uint32_t fallback;
    uint32_t epoch_before;
    float blend;
    float residual;
    dibs_vec3 surface_velocity;
    uint32_t contacts;
    float contacts_bound;
} tick_record;

#define TICK_KIND 1u

/* The whole run. */
typedef struct {
    uint32_t kind;
    uint32_t ticks;
    uint32_t deadline_misses;
    uint32_t latency_counts;
    uint32_t tick_counts;
    uint32_t records_dropped;
    uint32_t bus_overrun;
    uint32_t stack_bytes;
    uint32_t masked_counts;
    uint32_t bus_masked_counts;
    uint32_t scrub_rounds;
    uint32_t events[DIBS_EVENTS];
} summary_record;

#define SUMMARY_KIND 2u

/* The number that a record has for a cause of the fail-safe machine. */
uint32_t telemetry_cause(dibs_code cause);

/* Sends a record of any kind. */
void telemetry_send(const void *record, size_t size);

#endif
