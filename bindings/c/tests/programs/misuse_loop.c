/*
 * Every misuse of bus, guard and writer returns a code. tests/guard.rs runs this under the sanitizers.
 *
 *     misuse_loop TREE STREAM
 */
#include "expect.h"

#include <math.h>
#include <string.h>

#define VERTICES 502

MEMORY(memory, DIBS_START_SIZE(VERTICES));
MEMORY(tree_memory, DIBS_TREE_SIZE);
MEMORY(surface_memory, DIBS_GUARDED_SIZE(VERTICES));
MEMORY(plain_memory, DIBS_SURFACE_SIZE(VERTICES));
MEMORY(small_memory, DIBS_GUARDED_SIZE(10));
MEMORY(bus_memory, DIBS_BUS_SIZE);
MEMORY(guard_memory, DIBS_GUARD_SIZE);
MEMORY(contacts_memory, DIBS_CONTACTS_SIZE);
MEMORY(writer_memory, DIBS_WRITER_SIZE);
MEMORY(reader_memory, DIBS_READER_SIZE);
MEMORY(frame_memory, DIBS_FRAME_SIZE);
MEMORY(query_memory, DIBS_QUERY_SIZE);
MEMORY(unmade, 64);

static const dibs_wall wall = {1.0f, 0.002f, 0.0f, 5.0f, 5.0f};

static void start(const unsigned char *bytes, size_t length) {
    dibs_bus *bus = NULL;
    dibs_guard *guard = NULL;
    dibs_guard_limits limits = dibs_guard_limits_of(300.0f, 80);
    EXPECT(NULL, dibs_start(NULL, sizeof memory, bytes, length, &limits, &bus, &guard));
    EXPECT(NULL, dibs_start(memory, sizeof memory, NULL, length, &limits, &bus, &guard));
    EXPECT(NULL, dibs_start(memory, sizeof memory, bytes, length, NULL, &bus, &guard));
    EXPECT(NULL, dibs_start(memory, sizeof memory, bytes, length, &limits, NULL, &guard));
    EXPECT(NULL, dibs_start(memory, sizeof memory, bytes, length, &limits, &bus, NULL));
    EXPECT(STORAGE_SIZE, dibs_start(memory, 0, bytes, length, &limits, &bus, &guard));
    EXPECT(STORAGE_SIZE, dibs_start(memory, DIBS_START_BASE - 1, bytes, length, &limits, &bus, &guard));
    EXPECT(STORAGE_SIZE, dibs_start(memory, DIBS_START_BASE, bytes, length, &limits, &bus, &guard));
    EXPECT(STORAGE_SIZE, dibs_start(memory, sizeof memory - 1, bytes, length, &limits, &bus, &guard));
    EXPECT(STORAGE_ALIGNMENT, dibs_start(memory + 4, sizeof memory - 4, bytes, length, &limits, &bus, &guard));
    EXPECT(TREE_LENGTH, dibs_start(memory, sizeof memory, bytes, length - 4, &limits, &bus, &guard));
    limits.ticks_a_second = 0;
    EXPECT(ARGUMENT, dibs_start(memory, sizeof memory, bytes, length, &limits, &bus, &guard));
    limits.ticks_a_second = 1000;
    limits.options.flags = 8;
    EXPECT(ARGUMENT, dibs_start(memory, sizeof memory, bytes, length, &limits, &bus, &guard));
    limits.options.flags = 0;
    limits.speed = -1.0f;
    EXPECT(LIMIT_SPEED, dibs_start(memory, sizeof memory, bytes, length, &limits, &bus, &guard));
    limits.speed = NAN;
    EXPECT(LIMIT_SPEED, dibs_start(memory, sizeof memory, bytes, length, &limits, &bus, &guard));
    limits.speed = 300.0f;
    limits.age = UINT32_MAX;
    EXPECT(LIMIT_TOO_LONG, dibs_start(memory, sizeof memory, bytes, length, &limits, &bus, &guard));
    EXPECT_THAT(bus == NULL && guard == NULL);
    limits.age = 80;
    EXPECT(OK, dibs_start(memory, sizeof memory, bytes, length, &limits, &bus, &guard));

    dibs_answer answer;
    dibs_force force;
    EXPECT(NULL, dibs_guard_closest(NULL, &tool, 0, &answer));
    EXPECT(NULL, dibs_guard_closest(guard, &tool, 0, NULL));
    EXPECT(NOT_INITIALISED, dibs_guard_closest((dibs_guard *)(void *)bus, &tool, 0, &answer));
    EXPECT(MISALIGNED, dibs_guard_closest(guard, (const dibs_tool *)(const void *)(unmade + 1), 0, &answer));
    EXPECT(OK, dibs_guard_closest(guard, &tool, 0, &answer));
    EXPECT(NO_SURFACE, answer.outcome);
    EXPECT_THAT(answer.trust.state == DIBS_STATE_SAFE && answer.age.is_published == 0 && answer.lag == UINT32_MAX);
    EXPECT(NO_SURFACE, answer.searched.outcome);
    EXPECT_THAT(answer.searched.before == 0 && answer.searched.residual == -1.0f);
    EXPECT_THAT(answer.interval.lower == -INFINITY && answer.interval.upper == INFINITY);
    EXPECT(NULL, dibs_answer_force(NULL, &wall, &force));
    EXPECT(NULL, dibs_answer_force(&answer, NULL, &force));
    EXPECT(NULL, dibs_answer_force(&answer, &wall, NULL));
    EXPECT(OK, dibs_answer_force(&answer, &wall, &force));
    EXPECT(NO_SURFACE, force.cause);
    EXPECT(ACKNOWLEDGE, dibs_guard_acknowledge(guard));
    EXPECT(NULL, dibs_guard_acknowledge(NULL));

    dibs_contacts *list = NULL;
    dibs_contacts_facts listed;
    EXPECT(NULL, dibs_guard_contacts(guard, &tool, 5.0f, 0, NULL, &answer));
    EXPECT(OK, dibs_contacts_init(contacts_memory, sizeof contacts_memory, &list));
    EXPECT(NULL, dibs_guard_contacts(NULL, &tool, 5.0f, 0, list, &answer));
    EXPECT(NULL, dibs_guard_contacts(guard, &tool, 5.0f, 0, list, NULL));
    EXPECT(MISALIGNED, dibs_guard_contacts(guard, (const dibs_tool *)(const void *)(unmade + 1), 5.0f, 0, list, &answer));
    for (int without = 0; without < 2; without++) {
        EXPECT(OK, dibs_guard_contacts(guard, without ? NULL : &tool, 5.0f, 0, list, &answer));
        EXPECT_THAT(answer.outcome == (without ? DIBS_CODE_NO_POSE : DIBS_CODE_NO_SURFACE));
        EXPECT(OK, dibs_contacts_get_facts(list, &listed));
        EXPECT_THAT(listed.count == 0 && listed.bound == -INFINITY);
    }

    const dibs_filter filter = dibs_filter_of(1.0f, 200.0f);
    const dibs_filter none = dibs_filter_of(-1.0f, 200.0f);
    const dibs_rigid_motion command = {.about = tool.start};
    dibs_tool bad = tool;
    dibs_admitted_motion admitted = {.queries = 77};
    bad.radius = -1.0f;
    EXPECT(NULL, dibs_guard_admit(NULL, &filter, &tool, &command, 1, NULL, &admitted));
    EXPECT(NULL, dibs_guard_admit(guard, NULL, &tool, &command, 1, NULL, &admitted));
    EXPECT(NULL, dibs_guard_admit(guard, &filter, NULL, &command, 1, NULL, &admitted));
    EXPECT(NULL, dibs_guard_admit(guard, &filter, &tool, NULL, 1, NULL, &admitted));
    EXPECT(NULL, dibs_guard_admit(guard, &filter, &tool, &command, 1, NULL, NULL));
    EXPECT(FILTER, dibs_guard_admit(guard, &none, &tool, &command, 1, NULL, &admitted));
    EXPECT(NO_SURFACE, dibs_guard_admit(guard, &filter, &tool, &command, 1, &answer, &admitted));
    EXPECT(NO_SURFACE, answer.outcome);
    EXPECT(TOOL_RADIUS, dibs_guard_admit(guard, &filter, &bad, &command, 2, &answer, &admitted));
    EXPECT(TOOL_RADIUS, answer.outcome);
    EXPECT_THAT(admitted.queries == 77);

    unsigned char status[DIBS_STATUS];
    size_t count = 7;
    EXPECT(NULL, dibs_bus_receive(bus, NULL, 1, 0));
    EXPECT(NULL, dibs_bus_receive(NULL, unmade, 1, 0));
    EXPECT(NULL, dibs_bus_packet(bus, NULL, 1, 0, NULL));
    EXPECT(PACKET_DAMAGED, dibs_bus_packet(bus, unmade, 8, 0, NULL));
    static const float positions[3] = {1.0f, 2.0f, 3.0f};
    EXPECT(NULL, dibs_bus_frame(NULL, positions, 1, 0, 0));
    EXPECT(NULL, dibs_bus_frame(bus, NULL, 1, 0, 0));
    EXPECT(PACKET_ROWS, dibs_bus_frame(bus, positions, 1, 0, 0));
    const dibs_pose pose = {{0.0f, 0.0f, 0.6f, 0.8f}, {1.0f, 2.0f, 3.0f}};
    const dibs_pose stretched = {{0.0f, 0.0f, 0.0f, 1.1f}, {1.0f, 2.0f, 3.0f}};
    const dibs_pose nowhere = {{0.0f, 0.0f, 0.6f, 0.8f}, {NAN, 2.0f, 3.0f}};
    const dibs_pose beyond = {{0.0f, 0.0f, 0.6f, 0.8f}, {1e9f, 2.0f, 3.0f}};
    EXPECT(NULL, dibs_bus_frame_at(NULL, positions, 1, &pose, 0, 0));
    EXPECT(NULL, dibs_bus_frame_at(bus, NULL, 1, &pose, 0, 0));
    EXPECT(NULL, dibs_bus_frame_at(bus, positions, 1, NULL, 0, 0));
    EXPECT(PACKET_ROWS, dibs_bus_frame_at(bus, positions, 1, &pose, 0, 0));
    EXPECT(PACKET_FORM, dibs_bus_frame_at(bus, positions, 1, &stretched, 0, 0));
    EXPECT(PACKET_NOT_FINITE, dibs_bus_frame_at(bus, positions, 1, &nowhere, 0, 0));
    EXPECT(PACKET_TOO_FAR, dibs_bus_frame_at(bus, positions, 1, &beyond, 0, 0));
    EXPECT(NOT_INITIALISED, dibs_bus_work((dibs_bus *)(void *)guard, 1, NULL));
    EXPECT(NOT_INITIALISED, dibs_bus_register((dibs_bus *)(void *)unmade));
    EXPECT(OK, dibs_bus_register(bus));
    EXPECT(NULL, dibs_bus_counters(bus, NULL));
    dibs_bus_facts facts;
    dibs_vec3 at;
    EXPECT(NULL, dibs_bus_get_facts(bus, NULL));
    EXPECT(NULL, dibs_bus_get_facts(NULL, &facts));
    EXPECT(OK, dibs_bus_get_facts(bus, &facts));
    EXPECT_THAT(facts.is_published == 0 && facts.epoch == 0 && facts.rounds == 0);
    EXPECT(NULL, dibs_bus_position(bus, 0, NULL));
    EXPECT(NO_SURFACE, dibs_bus_position(bus, 0, &at));
    EXPECT(NULL, dibs_bus_status(bus, 500, 0, NULL, DIBS_STATUS, &count));
    EXPECT(NULL, dibs_bus_status(bus, 500, 0, status, sizeof status, NULL));
    EXPECT(CAPACITY, dibs_bus_status(bus, 500, 0, status, DIBS_STATUS - 1, &count));
    EXPECT_THAT(count == 7);
    EXPECT(OK, dibs_bus_status(bus, 500, 1, status, sizeof status, &count));
    EXPECT_THAT(count > 0);
    EXPECT(OK, dibs_bus_status(bus, 500, 1, status, sizeof status, &count));
    EXPECT_THAT(count == 0);
}

/* Each end is taken once, by one kind of object. */
static void ends(dibs_tree *tree) {
    dibs_surface *surface, *plain, *small;
    dibs_bus *bus;
    dibs_guard *guard;
    dibs_writer *writer;
    dibs_reader *reader;
    dibs_guard_limits limits = dibs_guard_limits_of(300.0f, 80);
    EXPECT(OK, dibs_surface_init(surface_memory, sizeof surface_memory, VERTICES, &surface));
    EXPECT(OK, dibs_surface_init(plain_memory, sizeof plain_memory, VERTICES, &plain));
    EXPECT(OK, dibs_surface_init(small_memory, sizeof small_memory, 10, &small));
    EXPECT(STORAGE_SIZE, dibs_bus_init(bus_memory, sizeof bus_memory, plain, tree, &limits, &bus));
    EXPECT(STORAGE_SIZE, dibs_guard_init(guard_memory, sizeof guard_memory, plain, tree, &limits, &guard));
    EXPECT(OTHER_TREE, dibs_bus_init(bus_memory, sizeof bus_memory, small, tree, &limits, &bus));
    EXPECT(OTHER_TREE, dibs_guard_init(guard_memory, sizeof guard_memory, small, tree, &limits, &guard));
    EXPECT(STORAGE_SIZE, dibs_bus_init(bus_memory, sizeof bus_memory - 1, surface, tree, &limits, &bus));
    EXPECT(STORAGE_SIZE, dibs_guard_init(guard_memory, sizeof guard_memory - 1, surface, tree, &limits, &guard));
    /* After an error the end is free. */
    limits.speed = -1.0f;
    EXPECT(LIMIT_SPEED, dibs_guard_init(guard_memory, sizeof guard_memory, surface, tree, &limits, &guard));
    limits.speed = 300.0f;
    EXPECT(OK, dibs_guard_init(guard_memory, sizeof guard_memory, surface, tree, &limits, &guard));
    EXPECT(TAKEN, dibs_guard_init(guard_memory, sizeof guard_memory, surface, tree, &limits, &guard));
    EXPECT(TAKEN, dibs_reader_init(reader_memory, sizeof reader_memory, surface, &reader));
    EXPECT(OK, dibs_bus_init(bus_memory, sizeof bus_memory, surface, tree, &limits, &bus));
    EXPECT(TAKEN, dibs_bus_init(bus_memory, sizeof bus_memory, surface, tree, &limits, &bus));
    EXPECT(TAKEN, dibs_writer_init(writer_memory, sizeof writer_memory, surface, &writer));
}

/* Frames of a writer, and a reader's answer. */
static void frames(dibs_tree *tree) {
    dibs_surface *surface;
    dibs_writer *writer;
    dibs_reader *reader;
    dibs_frame *frame;
    dibs_query *query;
    dibs_proximity found;
    dibs_frame_facts facts;
    float *positions = rest_shape(tree, VERTICES);
    EXPECT(OK, dibs_surface_init(plain_memory, sizeof plain_memory, VERTICES, &surface));
    EXPECT(STORAGE_SIZE, dibs_writer_init(writer_memory, DIBS_WRITER_SIZE - 1, surface, &writer));
    EXPECT(OK, dibs_writer_init(writer_memory, sizeof writer_memory, surface, &writer));
    EXPECT(OK, dibs_reader_init(reader_memory, sizeof reader_memory, surface, &reader));
    EXPECT(OK, dibs_frame_init(frame_memory, sizeof frame_memory, &frame));
    EXPECT(OK, dibs_query_init(query_memory, sizeof query_memory, tree, &query));
    EXPECT(NULL, dibs_writer_push(writer, NULL, 1));
    EXPECT(VERTEX_COUNT, dibs_writer_publish(writer, tree, 1, 0, 0.0f));
    for (uint32_t epoch = 1; epoch < 4; epoch++) {
        EXPECT(OK, dibs_writer_begin(writer));
        EXPECT(OK, dibs_writer_push(writer, positions, 500));
        EXPECT(VERTEX_COUNT, dibs_writer_push(writer, positions, 3));
        EXPECT(VERTEX_COUNT, dibs_writer_publish(writer, tree, epoch, 0, 0.0f));
        EXPECT(OK, dibs_writer_push(writer, positions + 3 * 500, 2));
        EXPECT(ARGUMENT, dibs_writer_publish(writer, tree, epoch, 0, -1.0f));
        EXPECT(ARGUMENT, dibs_writer_publish(writer, tree, epoch, 0, NAN));
        EXPECT(OK, dibs_writer_publish(writer, epoch == 2 ? NULL : tree, epoch, 10 * epoch, 0.5f));
        dibs_age age;
        EXPECT(OK, dibs_reader_latest(reader, 10 * epoch + 3, 50, frame, &age));
        EXPECT_THAT(age.epoch == epoch && age.age == 3);
        EXPECT(OK, dibs_frame_get_facts(frame, &facts));
        EXPECT_THAT(facts.position_error == 0.5f && (facts.stretch > 0.99f) == (epoch != 2));
        EXPECT(OK, dibs_query_closest(query, frame, &tool, NULL, &found));
        EXPECT_THAT(found.coverage == (epoch == 2 ? DIBS_COVERAGE_ASSUMED : DIBS_COVERAGE_MEASURED));
        /* The next frame waits for the reader. */
        EXPECT(OK, dibs_writer_begin(writer));
        EXPECT(OK, dibs_writer_push(writer, positions, VERTICES));
        EXPECT(HELD, dibs_writer_publish(writer, NULL, epoch, 0, 0.0f));
        EXPECT(OK, dibs_frame_release(frame));
    }
    positions[0] += 60.0f;
    EXPECT(OK, dibs_writer_begin(writer));
    EXPECT(OK, dibs_writer_push(writer, positions, VERTICES));
    EXPECT(STRETCH_EXCEEDED, dibs_writer_publish(writer, tree, 4, 0, 0.0f));
    EXPECT(OK, dibs_reader_latest(reader, 33, 50, frame, NULL));
    free(positions);
}

int main(int argc, char **argv) {
    size_t length;
    dibs_tree *tree;
    if (argc != 3) {
        return 2;
    }
    unsigned char *bytes = read_file(argv[1], &length);
    start(bytes, length);
    EXPECT(OK, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, &tree));
    ends(tree);
    frames(tree);
    free(bytes);
    return summary();
}
