/*
 * A controller's loop on frames of weights, every other one at a pose. tests/weights.rs compares each line with the Rust
 * library's.
 *
 *     weights TREE OTHER WEIGHTS
 *
 * OTHER      a tree of the same mesh, without modes
 * WEIGHTS    two of each frame, 32-bit floats
 */
#include "expect.h"

#include <math.h>
#include <string.h>

#define VERTICES 162
#define FRAMES 20
#define MODES 2
#define PERIOD 30

MEMORY(memory, DIBS_START_SIZE(VERTICES));
MEMORY(tree_memory, DIBS_TREE_SIZE);
MEMORY(other_memory, DIBS_TREE_SIZE);

static void print_float(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    printf("%08x ", bits);
}

int main(int argc, char **argv) {
    const dibs_pose pose = {{0.0f, 0.0f, 0.01f, 0.99995f}, {0.5f, -0.3f, 0.2f}};
    size_t length, other_length, weights_length;
    dibs_tree *tree = NULL, *other = NULL;
    dibs_bus *bus = NULL;
    dibs_guard *guard = NULL;
    dibs_answer answer;
    if (argc != 4) {
        return 2;
    }
    const unsigned char *bytes = read_file(argv[1], &length);
    const unsigned char *others = read_file(argv[2], &other_length);
    const float *weights = (const float *)read_file(argv[3], &weights_length);
    dibs_guard_limits limits = dibs_guard_limits_of(30000.0f, 80);
    limits.automatic = 1;
    EXPECT(OK, dibs_start(memory, sizeof memory, bytes, length, &limits, &bus, &guard));
    EXPECT(OK, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, &tree));
    EXPECT(OK, dibs_tree_init(other_memory, sizeof other_memory, others, other_length, &other));
    for (uint32_t frame = 0; frame < FRAMES; frame++) {
        const uint32_t now = 1000 + frame * PERIOD;
        const float *now_weights = weights + MODES * frame;
        const dibs_pose *at = frame % 2 == 1 ? &pose : NULL;
        dibs_advance advance = DIBS_ADVANCE_PENDING;
        EXPECT(OK, dibs_bus_weights(bus, tree, now_weights, MODES, at, now, now));
        while (advance == DIBS_ADVANCE_PENDING) {
            EXPECT(OK, dibs_bus_work(bus, 100, &advance));
        }
        EXPECT_THAT(advance == DIBS_ADVANCE_PUBLISHED);
        for (uint32_t row = 0; row < VERTICES; row++) {
            dibs_vec3 vertex;
            EXPECT(OK, dibs_bus_position(bus, row, &vertex));
            print_float(vertex.x);
            print_float(vertex.y);
            print_float(vertex.z);
        }
        (void)dibs_guard_closest(guard, &tool, now, &answer);
        const dibs_proximity *pair = &answer.searched.tracked.proximity;
        print_float(pair->separation);
        print_float(pair->accuracy);
        print_float(pair->point_on_surface.x);
        printf("\n");
    }
    const float wrong[] = {NAN, 1e30f};
    const float beyond[] = {weights[0], 1e30f};
    const uint32_t now = 1000 + FRAMES * PERIOD;
    EXPECT(PACKET_NOT_FINITE, dibs_bus_weights(bus, tree, wrong, MODES, NULL, now, now));
    EXPECT(PACKET_TOO_FAR, dibs_bus_weights(bus, tree, beyond, MODES, NULL, now, now));
    EXPECT(PACKET_ROWS, dibs_bus_weights(bus, tree, weights, MODES - 1, NULL, now, now));
    EXPECT(PACKET_ROWS, dibs_bus_weights(bus, tree, weights, 0, NULL, now, now));
    EXPECT(TREE_NO_MODES, dibs_bus_weights(bus, other, weights, MODES, NULL, now, now));
    EXPECT(NULL, dibs_bus_weights(bus, tree, NULL, MODES, NULL, now, now));
    EXPECT(NULL, dibs_bus_weights(bus, NULL, weights, MODES, NULL, now, now));
    EXPECT(NULL, dibs_bus_weights(NULL, tree, weights, MODES, NULL, now, now));
    dibs_bus_facts facts;
    EXPECT(OK, dibs_bus_get_facts(bus, &facts));
    EXPECT_THAT(facts.epoch == FRAMES);
    free((void *)weights);
    return summary();
}
