/*
 * Every misuse returns a code. tests/misuse.rs runs this under the address and the undefined-behaviour sanitizer.
 *
 *     misuse TREE STREAM
 *
 * STREAM is two frames in the bytes of a serial line.
 */
#include "expect.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <string.h>
#include <time.h>

MEMORY(tree_memory, DIBS_TREE_SIZE);
MEMORY(frame_memory, DIBS_FRAME_SIZE);
MEMORY(other_frame_memory, DIBS_FRAME_SIZE);
MEMORY(query_memory, DIBS_QUERY_SIZE);
MEMORY(other_query_memory, DIBS_QUERY_SIZE);
MEMORY(contacts_memory, DIBS_CONTACTS_SIZE);
MEMORY(surface_memory, DIBS_SURFACE_SIZE(502));
MEMORY(small_surface_memory, DIBS_SURFACE_SIZE(10));
MEMORY(receiver_memory, DIBS_RECEIVER_SIZE);
MEMORY(reader_memory, DIBS_READER_SIZE);
MEMORY(failsafe_memory, DIBS_FAILSAFE_SIZE);
MEMORY(scrub_memory, DIBS_SCRUB_SIZE);
MEMORY(unmade, 64);

static const dibs_wall wall = {1.0f, 0.002f, 0.002f, 5.0f, 5.0f};
static const dibs_surface_limits surface_limits = {300.0f, 1e9f, 0.25f, 0.0f};

static dibs_tree *tree;
static dibs_frame *frame;
static dibs_query *query;
static dibs_contacts *contacts;

/* Null, small or misaligned storage, of each kind of object. */
static void storage(const unsigned char *bytes, size_t length) {
    dibs_tree *t;
    EXPECT(NULL, dibs_tree_init(NULL, sizeof tree_memory, bytes, length, &t));
    EXPECT(NULL, dibs_tree_init(tree_memory, sizeof tree_memory, NULL, length, &t));
    EXPECT(NULL, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, NULL));
    EXPECT(STORAGE_SIZE, dibs_tree_init(tree_memory, DIBS_TREE_SIZE - 1, bytes, length, &t));
    EXPECT(STORAGE_ALIGNMENT, dibs_tree_init(tree_memory + DIBS_ALIGNMENT / 2, sizeof tree_memory, bytes, length, &t));
    EXPECT(TREE_LENGTH, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, 20, &t));
    EXPECT(TREE_LENGTH, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length - 4, &t));
    EXPECT(ARGUMENT, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, SIZE_MAX, &t));

    dibs_frame *f;
    EXPECT(NULL, dibs_frame_init(NULL, sizeof frame_memory, &f));
    EXPECT(STORAGE_SIZE, dibs_frame_init(frame_memory, DIBS_FRAME_SIZE - 1, &f));
    EXPECT(STORAGE_ALIGNMENT, dibs_frame_init(frame_memory + 1, DIBS_FRAME_SIZE, &f));
    dibs_contacts *c;
    EXPECT(STORAGE_SIZE, dibs_contacts_init(contacts_memory, 0, &c));
    EXPECT(STORAGE_ALIGNMENT, dibs_contacts_init(contacts_memory + 2, DIBS_CONTACTS_SIZE, &c));
    dibs_surface *s;
    EXPECT(STORAGE_SIZE, dibs_surface_init(surface_memory, DIBS_SURFACE_SIZE(502) - 1, 502, &s));
    EXPECT(STORAGE_SIZE, dibs_surface_init(surface_memory, sizeof surface_memory, UINT32_MAX, &s));
    EXPECT(STORAGE_ALIGNMENT, dibs_surface_init(surface_memory + 4, sizeof surface_memory, 10, &s));
}

/* Calls before the object is made, with an object of another kind, misaligned, null, or before a surface is set. */
static void order(void) {
    dibs_tree_facts facts;
    dibs_proximity found;
    dibs_query *q;
    dibs_receiver *r;
    dibs_reader *d;
    dibs_tree *no_tree = (dibs_tree *)(void *)unmade;
    dibs_query *no_query = (dibs_query *)(void *)unmade;
    dibs_frame *no_frame = (dibs_frame *)(void *)unmade;
    dibs_surface *no_surface = (dibs_surface *)(void *)unmade;
    EXPECT(NOT_INITIALISED, dibs_tree_get_facts(no_tree, &facts));
    EXPECT(NOT_INITIALISED, dibs_query_init(other_query_memory, sizeof other_query_memory, no_tree, &q));
    EXPECT(NOT_INITIALISED, dibs_query_closest((dibs_query *)(void *)other_query_memory, frame, &tool, NULL, &found));
    EXPECT(NOT_INITIALISED, dibs_query_closest(no_query, frame, &tool, NULL, &found));
    EXPECT(NOT_INITIALISED, dibs_query_closest(query, no_frame, &tool, NULL, &found));
    EXPECT(NOT_INITIALISED, dibs_query_closest(query, (dibs_frame *)(void *)query, &tool, NULL, &found));
    EXPECT(NOT_INITIALISED, dibs_frame_measure(frame, (dibs_tree *)(void *)frame, NULL));
    EXPECT(NOT_INITIALISED,
           dibs_receiver_init(receiver_memory, sizeof receiver_memory, no_surface, tree, &surface_limits, &r));
    EXPECT(NOT_INITIALISED, dibs_reader_init(reader_memory, sizeof reader_memory, no_surface, &d));
    EXPECT(NOT_INITIALISED, dibs_receiver_advance((dibs_receiver *)(void *)unmade, 1, NULL));
    EXPECT(MISALIGNED, dibs_tree_get_facts((dibs_tree *)(void *)(unmade + 2), &facts));
    EXPECT(NULL, dibs_tree_get_facts(NULL, &facts));
    EXPECT(NULL, dibs_tree_get_facts(tree, NULL));
    EXPECT(NO_SURFACE, dibs_query_closest(query, frame, &tool, NULL, &found));
    EXPECT(NO_SURFACE, dibs_frame_measure(frame, tree, NULL));
    EXPECT(NO_SURFACE, dibs_frame_get_facts(frame, &(dibs_frame_facts){0}));
}

/* Values that are out of range. */
static void values(const float *positions, uint32_t vertices) {
    dibs_proximity found;
    dibs_force force;
    dibs_contact contact;
    dibs_row rows[1];
    uint32_t budget;
    dibs_frame_facts facts;
    size_t count;
    const dibs_vec3 zero = {0.0f, 0.0f, 0.0f};
    const dibs_options options = {DIBS_UNLIMITED, 0.0f, 8, 0};
    const dibs_options label = {DIBS_UNLIMITED, 0.0f, DIBS_CONTACTS_OF, 256};
    const dibs_options tolerance = {DIBS_UNLIMITED, -1.0f, 0, 0};
    const dibs_tool no_radius = {tool.start, tool.end, -1.0f};
    const dibs_tool far_away = {{1e30f, 0.0f, 0.0f}, tool.end, 1.0f};
    const dibs_wall no_spring = {0.0f, 0.0f, 0.0f, 5.0f, 5.0f};

    EXPECT(NULL, dibs_frame_set_vertices(frame, NULL, vertices, 0.0f));
    EXPECT(MISALIGNED,
           dibs_frame_set_vertices(frame, (const float *)(const void *)((const char *)positions + 1), 1, 0.0f));
    EXPECT(ARGUMENT, dibs_frame_set_vertices(frame, positions, vertices, -1.0f));
    EXPECT(ARGUMENT, dibs_frame_set_nodes(frame, tree, positions, vertices, 0.0f));
    EXPECT(OK, dibs_frame_set_vertices(frame, positions, vertices - 1, 0.0f));
    EXPECT(VERTEX_COUNT, dibs_query_closest(query, frame, &tool, NULL, &found));
    EXPECT(VERTEX_COUNT, dibs_frame_measure(frame, tree, NULL));
    EXPECT(OK, dibs_frame_set_vertices(frame, positions, vertices, 0.25f));
    EXPECT(NULL, dibs_frame_get_facts(frame, NULL));
    EXPECT(OK, dibs_frame_get_facts(frame, &facts));
    EXPECT_THAT(facts.vertices == vertices && facts.position_error == 0.25f && facts.stretch == 0.0f);
    EXPECT(OK, dibs_frame_measure(frame, tree, NULL));
    EXPECT(OK, dibs_frame_get_facts(frame, &facts));
    EXPECT_THAT(facts.stretch >= 1.0f);
    EXPECT(OK, dibs_frame_set_vertices(frame, positions, vertices, 0.0f));

    EXPECT(NULL, dibs_query_closest(query, frame, NULL, NULL, &found));
    EXPECT(NULL, dibs_query_closest(query, frame, &tool, NULL, NULL));
    EXPECT(ARGUMENT, dibs_query_closest(query, frame, &tool, &options, &found));
    EXPECT(ARGUMENT, dibs_query_closest(query, frame, &tool, &label, &found));
    EXPECT(ARGUMENT, dibs_query_closest(query, frame, &tool, &tolerance, &found));
    EXPECT(TOOL_RADIUS, dibs_query_closest(query, frame, &no_radius, NULL, &found));
    EXPECT(TOOL_COORDINATE, dibs_query_closest(query, frame, &far_away, NULL, &found));
    EXPECT(ARGUMENT, dibs_budget_for_instructions(1000, 9, &budget));
    EXPECT(OK, dibs_query_closest(query, frame, &tool, NULL, &found));

    EXPECT(MARGIN, dibs_query_contacts(query, frame, &tool, -1.0f, NULL, contacts, NULL));
    EXPECT(OK, dibs_query_contacts(query, frame, &tool, 60.0f, NULL, contacts, NULL));
    EXPECT(ARGUMENT, dibs_contacts_get(contacts, DIBS_CONTACTS, &contact));
    EXPECT(CAPACITY, dibs_contacts_rows(contacts, zero, 1.0f, 20.0f, 0, rows, &count));
    EXPECT(VERTEX_COUNT, dibs_contacts_set_velocities(contacts, positions, 1));

    EXPECT(GAIN, dibs_wall_force(&no_spring, DIBS_CODE_OK, &found, zero, &force));
    EXPECT(NULL, dibs_wall_force(&wall, DIBS_CODE_OK, NULL, zero, &force));
    found.side = 99;
    EXPECT(ARGUMENT, dibs_wall_force(&wall, DIBS_CODE_OK, &found, zero, &force));
    /* A query's error gives a hold, without an answer. */
    EXPECT(OK, dibs_wall_force(&wall, DIBS_CODE_STALE, NULL, zero, &force));
    EXPECT(STALE, force.cause);
    EXPECT(OK, dibs_wall_proxy_force(&wall, 77777, contacts, zero, zero, zero, &force));
    EXPECT(ARGUMENT, force.cause);
}

/* A surface has one receiver and one reader. Before a frame is published there is no surface, but there is a status. */
static void two_readers(void) {
    dibs_surface *surface, *small;
    dibs_receiver *receiver, *receiver2;
    dibs_reader *reader, *reader2;
    dibs_frame *held;
    static alignas(DIBS_ALIGNMENT) unsigned char again[DIBS_RECEIVER_SIZE];
    EXPECT(OK, dibs_surface_init(surface_memory, sizeof surface_memory, 502, &surface));
    EXPECT(OK, dibs_surface_init(small_surface_memory, sizeof small_surface_memory, 10, &small));
    EXPECT(OTHER_TREE, dibs_receiver_init(receiver_memory, sizeof receiver_memory, small, tree, &surface_limits, &receiver));
    EXPECT(NULL, dibs_receiver_init(receiver_memory, sizeof receiver_memory, surface, tree, NULL, &receiver));
    EXPECT(OK, dibs_receiver_init(receiver_memory, sizeof receiver_memory, surface, tree, &surface_limits, &receiver));
    EXPECT(TAKEN, dibs_receiver_init(again, sizeof again, surface, tree, &surface_limits, &receiver2));
    EXPECT(OK, dibs_reader_init(reader_memory, sizeof reader_memory, surface, &reader));
    EXPECT(TAKEN, dibs_reader_init(again, sizeof again, surface, &reader2));

    EXPECT(OK, dibs_frame_init(other_frame_memory, sizeof other_frame_memory, &held));
    EXPECT(NO_SURFACE, dibs_reader_latest(reader, 0, 50, held, NULL));
    EXPECT(PACKET_DAMAGED, dibs_receiver_accept(receiver, again, 8, 0, NULL));
    EXPECT(NULL, dibs_receiver_accept(receiver, NULL, 8, 0, NULL));
    EXPECT(NULL, dibs_receiver_epoch(receiver, NULL));
    EXPECT(NO_SURFACE, dibs_receiver_epoch(receiver, &(uint32_t){0}));
    EXPECT(NULL, dibs_receiver_position(receiver, 0, NULL));
    EXPECT(NO_SURFACE, dibs_receiver_position(receiver, 0, &(dibs_vec3){0}));
    uint8_t status[DIBS_STATUS];
    size_t length;
    EXPECT(CAPACITY, dibs_receiver_status(receiver, 0, 0, 1, status, 10, &length));
    EXPECT(OK, dibs_receiver_status(receiver, 0, 0, 1, status, sizeof status, &length));
}

/* While one frame object holds the surface, no other can hold it, and nothing is published. */
static void held(const char *packets, const float *positions, uint32_t vertices) {
    dibs_receiver *receiver = (dibs_receiver *)(void *)receiver_memory;
    dibs_reader *reader = (dibs_reader *)(void *)reader_memory;
    dibs_frame *first = (dibs_frame *)(void *)other_frame_memory;
    dibs_advance advance = DIBS_ADVANCE_IDLE;
    size_t length;
    unsigned char *bytes = read_file(packets, &length);
    for (size_t at = 0; at < length && advance != DIBS_ADVANCE_HELD; at++) {
        EXPECT(OK, dibs_receiver_byte(receiver, bytes[at], 10, NULL));
        EXPECT(OK, dibs_receiver_advance(receiver, 10000, &advance));
        if (advance == DIBS_ADVANCE_PUBLISHED) {
            EXPECT(OK, dibs_reader_latest(reader, 10, 50, first, NULL));
            EXPECT(HELD, dibs_reader_latest(reader, 10, 50, frame, NULL));
        }
    }
    EXPECT(OK, advance == DIBS_ADVANCE_HELD ? DIBS_CODE_OK : DIBS_CODE_HELD);
    EXPECT(OK, dibs_frame_release(first));
    EXPECT(OK, dibs_receiver_advance(receiver, 10, &advance));
    EXPECT(OK, advance == DIBS_ADVANCE_PUBLISHED ? DIBS_CODE_OK : DIBS_CODE_HELD);
    EXPECT(STALE, dibs_reader_latest(reader, 1000, 50, frame, NULL));
    /* No frame grows younger. */
    EXPECT(STALE, dibs_reader_latest(reader, 11, 50, frame, NULL));
    EXPECT(OK, dibs_reader_latest(reader, 11, 1000, frame, NULL));
    EXPECT(OK, dibs_frame_release(frame));
    /* The stream is two frames of the shape at rest. */
    uint32_t epoch;
    EXPECT(OK, dibs_receiver_epoch(receiver, &epoch));
    EXPECT_THAT(epoch == 2);
    dibs_vec3 at;
    for (uint32_t row = 0; row < vertices; row++) {
        EXPECT(OK, dibs_receiver_position(receiver, row, &at));
        EXPECT_THAT(memcmp(&at, positions + 3 * row, sizeof at) == 0);
    }
    EXPECT(ARGUMENT, dibs_receiver_position(receiver, vertices, &at));
    free(bytes);
}

static void failsafe(void) {
    dibs_failsafe *machine;
    dibs_verdict verdict;
    dibs_proximity found = {0};
    dibs_observation seen = {.query = 12345};
    const dibs_watch off = {DIBS_UNLIMITED, DIBS_UNLIMITED};
    dibs_limits limits = {off, off, off, off, off, off, off, 0.1f, 1, 0, 0, 0};
    EXPECT(LIMIT_TOO_LONG, dibs_failsafe_init(failsafe_memory, sizeof failsafe_memory, &limits, &machine));
    limits.age = (dibs_watch){60, 20};
    EXPECT(LIMIT_ORDER, dibs_failsafe_init(failsafe_memory, sizeof failsafe_memory, &limits, &machine));
    limits.age = (dibs_watch){20, 60};
    limits.recovery_frames = 65536;
    EXPECT(LIMIT_RECOVERY, dibs_failsafe_init(failsafe_memory, sizeof failsafe_memory, &limits, &machine));
    limits.recovery_frames = 1;
    limits.tissue_speed = -1.0f;
    EXPECT(LIMIT_SPEED, dibs_failsafe_init(failsafe_memory, sizeof failsafe_memory, &limits, &machine));
    limits.tissue_speed = 0.1f;
    limits.forgeries = (dibs_watch){0, 1000};
    EXPECT(LIMIT_UNTRIPPABLE, dibs_failsafe_init(failsafe_memory, sizeof failsafe_memory, &limits, &machine));
    limits.forgeries = off;
    EXPECT(OK, dibs_failsafe_init(failsafe_memory, sizeof failsafe_memory, &limits, &machine));
    EXPECT(ARGUMENT, dibs_failsafe_step(machine, &seen, &verdict));
    EXPECT(NULL, dibs_failsafe_step(machine, NULL, &verdict));
    EXPECT(ACKNOWLEDGE, dibs_failsafe_acknowledge(machine));
    seen.query = DIBS_CODE_UNCOVERED;
    EXPECT(OK, dibs_failsafe_step(machine, &seen, &verdict));
    EXPECT(NO_SURFACE, verdict.cause);
    seen.age.is_published = 1;
    EXPECT(OK, dibs_failsafe_step(machine, &seen, &verdict));
    EXPECT(UNCOVERED, verdict.cause);
    EXPECT(UNCOVERED, dibs_verdict_admit(&verdict, &found));
    verdict.state = 7;
    EXPECT(ARGUMENT, dibs_verdict_admit(&verdict, &found));
}

static atomic_bool is_over;

static void *keep_asking(void *unused) {
    dibs_proximity found;
    while (!atomic_load(&is_over)) {
        (void)dibs_query_closest(query, frame, &tool, NULL, &found);
    }
    return unused;
}

/* Of two threads in one query, the second gets DIBS_CODE_IN_USE. */
static void in_use(void) {
    pthread_t other;
    dibs_proximity found;
    bool is_seen = false;
    if (pthread_create(&other, NULL, keep_asking, NULL) != 0) {
        exit(2);
    }
    /* On a busy computer the other thread may start late, so that no number of calls is enough. */
    for (const time_t start = time(NULL); time(NULL) - start < 60 && !is_seen;) {
        is_seen = dibs_query_closest(query, frame, &tool, NULL, &found) == DIBS_CODE_IN_USE;
    }
    atomic_store(&is_over, true);
    pthread_join(other, NULL);
    EXPECT(OK, is_seen ? DIBS_CODE_OK : DIBS_CODE_IN_USE);
}

/* No two codes share a text. Each is printed after its number. */
static void texts(void) {
    const char *unknown = dibs_code_text(99999);
    unsigned codes = 0;
    for (uint32_t a = 0; a < 600; a++) {
        if (strcmp(dibs_code_text(a), unknown) == 0) {
            continue;
        }
        codes++;
        printf("%u %s\n", a, dibs_code_text(a));
        for (uint32_t b = 0; b < a; b++) {
            EXPECT(OK, strcmp(dibs_code_text(a), dibs_code_text(b)) == 0 ? DIBS_CODE_ARGUMENT : DIBS_CODE_OK);
        }
    }
    EXPECT(OK, codes > 60 ? DIBS_CODE_OK : DIBS_CODE_ARGUMENT);
}

int main(int argc, char **argv) {
    size_t length;
    if (argc != 3) {
        return 2;
    }
    EXPECT(OK, dibs_check_version(DIBS_VERSION));
    EXPECT(VERSION, dibs_check_version(DIBS_VERSION + 1));
    unsigned char *bytes = read_file(argv[1], &length);
    storage(bytes, length);
    bytes[length / 2] ^= 1;
    EXPECT(TREE_CHECKSUM, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, &tree));
    EXPECT(NOT_INITIALISED, dibs_tree_get_facts((dibs_tree *)(void *)tree_memory, &(dibs_tree_facts){0}));
    bytes[length / 2] ^= 1;
    EXPECT(OK, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, &tree));
    EXPECT(OK, dibs_frame_init(frame_memory, sizeof frame_memory, &frame));

    dibs_query *no_query = (dibs_query *)(void *)query_memory;
    dibs_proximity found;
    EXPECT(NOT_INITIALISED, dibs_query_closest(no_query, frame, &tool, NULL, &found));
    EXPECT(STORAGE_SIZE, dibs_query_init(query_memory, DIBS_QUERY_SIZE - 8, tree, &query));
    EXPECT(OK, dibs_query_init(query_memory, sizeof query_memory, tree, &query));
    EXPECT(OK, dibs_contacts_init(contacts_memory, sizeof contacts_memory, &contacts));

    dibs_tree_facts facts;
    EXPECT(OK, dibs_tree_get_facts(tree, &facts));
    float *positions = rest_shape(tree, facts.vertices);
    EXPECT(TREE_NO_REST_SHAPE, dibs_tree_rest_position(tree, facts.vertices, &(dibs_vec3){0}));
    dibs_point origin = {1, 1, 1};
    EXPECT(OK, dibs_tree_origin(tree, &origin));
    EXPECT(NULL, dibs_tree_origin(tree, NULL));

    order();
    values(positions, facts.vertices);
    two_readers();
    in_use();
    held(argv[2], positions, facts.vertices);
    failsafe();
    texts();

    dibs_scrub *scrub;
    EXPECT(OK, dibs_scrub_init(scrub_memory, sizeof scrub_memory, tree, &scrub));
    EXPECT(OK, dibs_scrub_step(scrub, length));
    EXPECT(NOT_INITIALISED, dibs_tree_check((dibs_tree *)(void *)unmade));
    EXPECT(OK, dibs_tree_check(tree));
    /* The stretch limit, which was decoded: no scrub would read it. */
    bytes[28] ^= 1;
    EXPECT(TREE_CORRUPT, dibs_tree_check(tree));
    bytes[28] ^= 1;
    bytes[length - 1] ^= 4;
    EXPECT(TREE_CORRUPT, dibs_scrub_step(scrub, length));

    free(positions);
    free(bytes);
    return summary();
}
