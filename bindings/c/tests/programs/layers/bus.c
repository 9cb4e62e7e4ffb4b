#include "bus.h"

#include <math.h>
#include <stdalign.h>
#include <stdio.h>
#include <stdlib.h>

#include "print.h"
#include "track.h"

/* Rows and triangles that are checked after each packet. */
#define WORK 200

static alignas(DIBS_ALIGNMENT) uint8_t surface_memory[DIBS_SURFACE_SIZE(VERTICES)];
static alignas(DIBS_ALIGNMENT) uint8_t receiver_memory[DIBS_RECEIVER_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t reader_memory[DIBS_READER_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t failsafe_memory[DIBS_FAILSAFE_SIZE];

static dibs_receiver *receiver;
static dibs_reader *reader;
static dibs_failsafe *failsafe;

static const dibs_wall wall = {
    .stiffness = 1.0f, .damping = 0.002f, .hold_damping = 0.002f, .max_force = 5.0f, .margin = 5.0f};

void bus_init(dibs_tree *tree, uint32_t vertices) {
    dibs_surface *surface;
    const dibs_surface_limits surface_limits = {.reach = 300.0f, .speed = INFINITY, .shrinkage = 0.25f};
    const dibs_watch off = {DIBS_UNLIMITED, DIBS_UNLIMITED};
    const dibs_limits limits = {
        .age = {40, 80},
        .silence = {30, 100},
        .heartbeat = off,
        .rejections = {1, 10},
        .transit = off,
        .source_age = off,
        .forgeries = off,
        .tissue_speed = 0.1f,
        .recovery_frames = 2,
        .dwell = 3,
        /* The frames of the script echo nothing. */
        .without_transit = 1,
        .automatic = 1};
    must(dibs_surface_init(surface_memory, sizeof surface_memory, vertices, &surface));
    must(dibs_receiver_init(receiver_memory, sizeof receiver_memory, surface, tree, &surface_limits, &receiver));
    must(dibs_reader_init(reader_memory, sizeof reader_memory, surface, &reader));
    must(dibs_failsafe_init(failsafe_memory, sizeof failsafe_memory, &limits, &failsafe));
    track_init(tree);
}

void bus_packet(const uint8_t *bytes, size_t length, uint32_t now) {
    dibs_progress progress = DIBS_PROGRESS_NONE;
    dibs_advance advance = DIBS_ADVANCE_IDLE;
    const dibs_code accepted = dibs_receiver_accept(receiver, bytes, length, now, &progress);
    dibs_code checked = dibs_receiver_advance(receiver, WORK, &advance);
    while (checked == DIBS_CODE_OK && advance == DIBS_ADVANCE_PENDING) {
        advance = DIBS_ADVANCE_IDLE; /* An error sets nothing. */
        checked = dibs_receiver_advance(receiver, WORK, &advance);
    }
    printf("packet %u %u %u %u\n", accepted, progress, checked, advance);
}

void bus_tick(dibs_frame *frame, dibs_query *query, const dibs_tool *tool, uint32_t now) {
    const dibs_vec3 velocity = {10.0f, -20.0f, 5.0f};
    dibs_observation seen = {.query = DIBS_CODE_OK, .is_tree_corrupt = 0};
    dibs_verdict verdict;
    dibs_proximity found;
    dibs_force force;

    dibs_code code = dibs_reader_latest(reader, now, DIBS_UNLIMITED, frame, &seen.age);
    if (code == DIBS_CODE_OK) {
        code = dibs_query_closest(query, frame, tool, NULL, &found);
        seen.query = code;
        track(frame, &seen.age, tool);
        must(dibs_frame_release(frame));
    }
    must(dibs_reader_link(reader, now, &seen.link));
    must(dibs_failsafe_step(failsafe, &seen, &verdict));
    if (code == DIBS_CODE_OK) {
        code = dibs_verdict_admit(&verdict, &found);
    }
    must(dibs_wall_force(&wall, code, &found, velocity, &force));

    printf("tick %u %u %u %u", code, verdict.state, verdict.cause, seen.age.age);
    print_floats(&verdict.margin, 1);
    if (code == DIBS_CODE_OK) {
        print_proximity(&found);
    }
    print_force(&force);
    printf("\n");
}
