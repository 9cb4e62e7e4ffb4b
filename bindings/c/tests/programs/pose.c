/*
 * A controller's loop on frames with a rigid pose each. tests/pose.rs compares each line with the Rust library's.
 *
 *     pose TREE FRAME POSES
 *
 * FRAME    x, y, z of each vertex, 32-bit floats
 * POSES    x, y, z, w of a rotation, then a shift, 32-bit floats, one a frame
 */
#include "expect.h"

#include <string.h>

#define VERTICES 162
#define FRAMES 20
#define PERIOD 30

MEMORY(memory, DIBS_START_SIZE(VERTICES));

static void read_floats(const char *path, void *into, size_t bytes) {
    FILE *file = fopen(path, "rb");
    if (file == NULL || fread(into, 1, bytes, file) != bytes) {
        exit(2);
    }
    fclose(file);
}

static void print_float(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    printf("%08x ", bits);
}

int main(int argc, char **argv) {
    static float positions[3 * VERTICES];
    static dibs_pose poses[FRAMES];
    size_t length;
    dibs_bus *bus = NULL;
    dibs_guard *guard = NULL;
    dibs_answer answer;
    if (argc != 4) {
        return 2;
    }
    const unsigned char *tree = read_file(argv[1], &length);
    read_floats(argv[2], positions, sizeof positions);
    read_floats(argv[3], poses, sizeof poses);
    dibs_guard_limits limits = dibs_guard_limits_of(300.0f, 80);
    limits.automatic = 1;
    EXPECT(OK, dibs_start(memory, sizeof memory, tree, length, &limits, &bus, &guard));
    for (uint32_t frame = 0; frame < FRAMES; frame++) {
        const uint32_t now = 1000 + frame * PERIOD;
        dibs_advance advance = DIBS_ADVANCE_PENDING;
        EXPECT(OK, dibs_bus_frame_at(bus, positions, VERTICES, &poses[frame], now, now));
        while (advance == DIBS_ADVANCE_PENDING) {
            EXPECT(OK, dibs_bus_work(bus, 100, &advance));
        }
        EXPECT_THAT(advance == DIBS_ADVANCE_PUBLISHED);
        (void)dibs_guard_closest(guard, &tool, now + 11, &answer);
        const dibs_proximity *pair = &answer.searched.tracked.proximity;
        const float numbers[] = {
            pair->separation,         pair->accuracy,           pair->point_on_surface.x,
            pair->point_on_surface.y, pair->point_on_surface.z, pair->direction.x,
            answer.velocity.x,        answer.searched.residual,
        };
        for (size_t at = 0; at < sizeof numbers / sizeof *numbers; at++) {
            print_float(numbers[at]);
        }
        printf("\n");
    }
    printf("%u checks, %u failures\n", checks, failures);
    return failures == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
