/*
 * A sender and a bus in one program, with UDP between them. tests/sender.rs reads what it prints.
 *
 *     sender TREE SENT EXPECTED
 *
 * SENT      x, y, z of each vertex of the mesh's file, 32-bit floats, frame after frame
 * EXPECTED  the same of each row of the tree
 */
#include "expect.h"

#include <arpa/inet.h>
#include <math.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

#define FRAMES 12
#define MOST_VERTICES 600

MEMORY(start_memory, DIBS_START_SIZE(MOST_VERTICES));
MEMORY(tree_memory, DIBS_TREE_SIZE);
MEMORY(mirror_memory, DIBS_START_SIZE(MOST_VERTICES));
MEMORY(sender_memory, DIBS_SENDER_SIZE);

static dibs_bus *bus;
static dibs_guard *guard;
static dibs_sender *sender;
static int line;
static struct sockaddr_in peer;

/* Allocations of this thread: the linker puts these in place of the C library's. */
static _Thread_local unsigned allocations;
void *__real_malloc(size_t);
void *__real_calloc(size_t, size_t);
void *__real_realloc(void *, size_t);
int __real_posix_memalign(void **, size_t, size_t);
void *__wrap_malloc(size_t size) { return allocations++, __real_malloc(size); }
void *__wrap_calloc(size_t count, size_t size) { return allocations++, __real_calloc(count, size); }
void *__wrap_realloc(void *memory, size_t size) { return allocations++, __real_realloc(memory, size); }
int __wrap_posix_memalign(void **out, size_t alignment, size_t size) {
    return allocations++, __real_posix_memalign(out, alignment, size);
}

static uint32_t now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (uint32_t)(time.tv_sec * 1000 + time.tv_nsec / 1000000);
}

/* A socket of its own, whose address becomes the sender's target. */
static void open_line(char *target, size_t size) {
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t length = sizeof here;
    int room = 1 << 20;
    line = socket(AF_INET, SOCK_DGRAM, 0);
    EXPECT_THAT(bind(line, (struct sockaddr *)&here, sizeof here) == 0);
    EXPECT_THAT(getsockname(line, (struct sockaddr *)&here, &length) == 0);
    setsockopt(line, SOL_SOCKET, SO_RCVBUF, &room, sizeof room);
    snprintf(target, size, "udp:127.0.0.1:%u", ntohs(here.sin_port));
}

/* Gives the bus what has come at `time` on its clock, and sends its statuses back. */
static void receive(uint32_t time) {
    uint8_t packet[2048], status[DIBS_STATUS];
    struct pollfd waiting = {.fd = line, .events = POLLIN};
    size_t length = 0;
    while (poll(&waiting, 1, 1) > 0) {
        socklen_t size = sizeof peer;
        const ssize_t bytes = recvfrom(line, packet, sizeof packet, 0, (struct sockaddr *)&peer, &size);
        EXPECT(OK, dibs_bus_packet(bus, packet, (size_t)bytes, time, NULL));
        EXPECT(OK, dibs_bus_work(bus, 10000, NULL));
    }
    EXPECT(OK, dibs_bus_work(bus, 10000, NULL));
    EXPECT(OK, dibs_bus_status(bus, time, 0, status, sizeof status, &length));
    if (length > 0) {
        sendto(line, status, length, 0, (struct sockaddr *)&peer, sizeof peer);
    }
}

/* Receives at `time` on the bus's clock until the sender knows that its frame was published, for at most ten seconds. */
static int is_acknowledged(uint32_t epoch, uint32_t time) {
    const uint32_t start = now();
    while (now() - start < 10000) {
        dibs_sender_facts facts;
        receive(time);
        EXPECT(OK, dibs_sender_poll(sender));
        EXPECT(OK, dibs_sender_get_facts(sender, &facts, NULL));
        if (facts.is_acknowledged && facts.acknowledged == epoch) {
            return facts.in_flight == 0;
        }
    }
    return 0;
}

/* Whether the published rows are these, but for so many millimetres. */
static int is_published(const float *rows, uint32_t count, float error) {
    for (uint32_t row = 0; row < count; row++) {
        dibs_vec3 at;
        EXPECT(OK, dibs_bus_position(bus, row, &at));
        const float x = at.x - rows[3 * row], y = at.y - rows[3 * row + 1], z = at.z - rows[3 * row + 2];
        if (!(sqrtf(x * x + y * y + z * z) <= error)) {
            return 0;
        }
    }
    return 1;
}

/* The answer of a tick, as bits. */
static void answer_of(dibs_guard *of, uint32_t time, float numbers[8]) {
    dibs_answer answer;
    EXPECT(OK, dibs_guard_closest(of, &tool, time, &answer));
    const dibs_proximity *pair = &answer.searched.tracked.proximity;
    const float found[8] = {
        pair->separation,         pair->accuracy,           pair->point_on_surface.x,
        pair->point_on_surface.y, pair->point_on_surface.z, pair->direction.x,
        answer.velocity.x,        answer.searched.residual,
    };
    memcpy(numbers, found, sizeof found);
}

/* Frames with a pose each are on the bus as the same frames by a call. Returns how many. */
static unsigned send_poses(dibs_tree *tree, const char *target, const unsigned char *bytes, size_t length,
                           const dibs_guard_limits *limits, float *positions, uint32_t vertices) {
    dibs_bus *mirror;
    dibs_guard *mirrored;
    dibs_sent_frame sent;
    char sentence[512];
    unsigned received = 0;
    dibs_sender_settings settings = dibs_sender_settings_of();
    settings.quantised = 0;
    settings.session++;
    EXPECT(OK, dibs_sender_init(sender_memory, sizeof sender_memory, tree, target, &settings, &sender));
    EXPECT(OK, dibs_start(start_memory, sizeof start_memory, bytes, length, limits, &bus, &guard));
    EXPECT(OK, dibs_start(mirror_memory, sizeof mirror_memory, bytes, length, limits, &mirror, &mirrored));
    for (uint32_t frame = 0; frame < FRAMES; frame++) {
        const uint32_t time = 1000 + 30 * frame;
        const float half = 0.2f + 0.01f * (float)frame;
        const dibs_pose pose = {{0.0f, sinf(half), 0.0f, cosf(half)}, {3.0f, -2.0f, 0.5f * (float)frame}};
        float far[8], near[8];
        EXPECT(OK, dibs_sender_send_at(sender, positions, vertices, &pose, 4, &sent));
        EXPECT_THAT(is_acknowledged(sent.epoch, time));
        EXPECT(OK, dibs_bus_frame_at(mirror, positions, vertices, &pose, time - 4, time));
        EXPECT(OK, dibs_bus_work(mirror, 10000, NULL));
        answer_of(guard, time + 11, far);
        answer_of(mirrored, time + 11, near);
        received += memcmp(far, near, sizeof far) == 0;

        /* Numbers that are no pose: nothing is sent. */
        dibs_pose wrong = pose;
        wrong.rotation[3] += 0.1f;
        EXPECT(SENDER_FRAME, dibs_sender_send_at(sender, positions, vertices, &wrong, 0, NULL));
        EXPECT(OK, dibs_sender_error(sender, (uint8_t *)sentence, sizeof sentence));
        EXPECT_THAT(strstr(sentence, "is no rotation") != NULL);
        wrong = pose;
        wrong.shift.y = NAN;
        EXPECT(SENDER_FRAME, dibs_sender_send_at(sender, positions, vertices, &wrong, 0, NULL));
        EXPECT(OK, dibs_sender_error(sender, (uint8_t *)sentence, sizeof sentence));
        EXPECT_THAT(strstr(sentence, "not finite") != NULL);
        EXPECT(ARGUMENT, dibs_sender_send_at(sender, positions, vertices, &pose, DIBS_AGE_UNKNOWN, NULL));
        EXPECT(NULL, dibs_sender_send_at(sender, positions, vertices, NULL, 0, NULL));
    }
    dibs_sender_facts facts;
    EXPECT(OK, dibs_sender_get_facts(sender, &facts, NULL));
    EXPECT_THAT(facts.frames == FRAMES);
    EXPECT(OK, dibs_sender_close(sender));
    return received;
}

int main(int argc, char **argv) {
    size_t length, sent_length, expected_length;
    char target[64], sentence[512];
    dibs_tree *tree = NULL;
    dibs_tree_facts of_tree;
    dibs_sent_frame sent;
    dibs_sender_settings settings = dibs_sender_settings_of();
    unsigned received = 0, allocated = 0;
    if (argc != 4) {
        return 2;
    }
    const unsigned char *bytes = read_file(argv[1], &length);
    float *frames = (float *)(void *)read_file(argv[2], &sent_length);
    const float *expected = (const float *)(const void *)read_file(argv[3], &expected_length);
    EXPECT(OK, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, &tree));
    EXPECT(OK, dibs_tree_get_facts(tree, &of_tree));
    const uint32_t vertices = of_tree.file_vertices, rows = of_tree.rows;
    EXPECT_THAT(vertices == rows + 1 && sent_length == vertices * 12ul * FRAMES && expected_length == rows * 12ul * FRAMES);
    const dibs_guard_limits limits = dibs_guard_limits_of(100000.0f, 1000);
    EXPECT(OK, dibs_start(start_memory, DIBS_START_SIZE(rows), bytes, length, &limits, &bus, &guard));

    open_line(target, sizeof target);
    EXPECT(SENDER_TARGET, dibs_sender_init(sender_memory, sizeof sender_memory, tree, "pigeon:3", NULL, &sender));
    EXPECT(SENDER_TARGET, dibs_sender_init(sender_memory, sizeof sender_memory, tree, "serial:/nowhere@9600", NULL, &sender));
    EXPECT(NULL, dibs_sender_init(sender_memory, sizeof sender_memory, tree, NULL, NULL, &sender));
    EXPECT(STORAGE_SIZE, dibs_sender_init(sender_memory, 8, tree, target, NULL, &sender));
    settings.partial = NAN;
    EXPECT(ARGUMENT, dibs_sender_init(sender_memory, sizeof sender_memory, tree, target, &settings, &sender));
    EXPECT(NOT_INITIALISED, dibs_sender_poll((dibs_sender *)(void *)sender_memory));
    EXPECT(OK, dibs_sender_init(sender_memory, sizeof sender_memory, tree, target, NULL, &sender));
    EXPECT(CAPACITY, dibs_sender_error(sender, (uint8_t *)sentence, 0));

    for (uint32_t frame = 0; frame < FRAMES; frame++) {
        float *positions = frames + 3ul * vertices * frame;
        const unsigned before = allocations;
        EXPECT(OK, dibs_sender_send(sender, positions, vertices, frame % 2 == 0 ? DIBS_AGE_UNKNOWN : 3, &sent));
        allocated += frame > 1 ? allocations - before : 0;
        EXPECT_THAT(sent.epoch > frame && sent.rows == rows && sent.is_partial == 0 && sent.error < 0.01f);
        EXPECT_THAT(is_acknowledged(sent.epoch, now()));
        received += is_published(expected + 3ul * rows * frame, rows, sent.error);

        /* What cannot be sent leaves the receiver as it was. */
        EXPECT(SENDER_FRAME, dibs_sender_send(sender, positions, vertices - 1, 0, &sent));
        EXPECT(OK, dibs_sender_error(sender, (uint8_t *)sentence, sizeof sentence));
        EXPECT_THAT(strstr(sentence, "vertices") != NULL);
        const float kept = positions[4];
        positions[4] = NAN;
        EXPECT(SENDER_FRAME, dibs_sender_send(sender, positions, vertices, 0, &sent));
        positions[4] = kept;
        EXPECT_THAT(is_published(expected + 3ul * rows * frame, rows, sent.error));
    }
    printf("%u frames received, %u allocations\n", received, allocated);
    dibs_sender_facts facts;
    uint32_t counters[DIBS_EVENTS];
    EXPECT(OK, dibs_sender_get_facts(sender, &facts, counters));
    EXPECT_THAT(facts.frames == FRAMES && facts.statuses > 0);
    EXPECT(OK, dibs_sender_close(sender));
    EXPECT(NOT_INITIALISED, dibs_sender_send(sender, frames, vertices, 0, &sent));
    EXPECT(NOT_INITIALISED, dibs_sender_close(sender));
    printf("%u poses received\n", send_poses(tree, target, bytes, length, &limits, frames, vertices));
    free((void *)bytes);
    free(frames);
    free((void *)expected);
    return summary();
}
