/*
 * Sweeps between frames. tests/sweep.rs compares each line with the Rust library's.
 *
 *     sweep TREE FRAMES
 *
 * FRAMES    x, y, z of each vertex in the tree's order, 32-bit floats, frame after frame
 */
#include "expect.h"

#include <math.h>
#include <string.h>

#define VERTICES 502
#define FRAMES 4

MEMORY(tree_memory, DIBS_TREE_SIZE);
MEMORY(frame_memory, DIBS_FRAME_SIZE);
MEMORY(tracker_memory, DIBS_TRACKER_SIZE(VERTICES));

static dibs_tool tool_at(float x, uint32_t number) {
    const float y = 10.0f + (float)number;
    return (dibs_tool){{x, y, 20.0f}, {x + 40.0f, y, 40.0f}, 2.5f};
}

int main(int argc, char **argv) {
    static const float ways[4][2] = {{90.0f, 88.0f}, {80.0f, 46.0f}, {80.0f, -80.0f}, {60.0f, 60.0f}};
    static float frames[FRAMES][VERTICES * 3];
    size_t length, size;
    dibs_tree *tree = NULL;
    dibs_frame *frame = NULL;
    dibs_tracker *tracker = NULL;
    dibs_swept swept;
    if (argc != 3) {
        return 2;
    }
    const unsigned char *bytes = read_file(argv[1], &length);
    unsigned char *of_frames = read_file(argv[2], &size);
    EXPECT_THAT(size == sizeof frames);
    memcpy(frames, of_frames, sizeof frames);
    free(of_frames);
    EXPECT(OK, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, &tree));
    EXPECT(OK, dibs_frame_init(frame_memory, sizeof frame_memory, &frame));
    EXPECT(OK, dibs_tracker_init(tracker_memory, sizeof tracker_memory, tree, &tracker));
    dibs_sweep sweep = {tool, tool, {0.25f, 1.0f}, 1.5f, 24};
    EXPECT(NO_SURFACE, dibs_tracker_sweep(tracker, &sweep, NULL, &swept));
    for (uint32_t number = 0; number < FRAMES; number++) {
        EXPECT(OK, dibs_frame_set_vertices(frame, frames[number], VERTICES, 0.0f));
        EXPECT(OK, dibs_tracker_set_frame(tracker, frame));
        for (size_t way = 0; number > 0 && way < 4; way++) {
            sweep.from = tool_at(ways[way][0], number - 1);
            sweep.to = tool_at(ways[way][1], number - 1);
            EXPECT(OK, dibs_tracker_sweep(tracker, &sweep, NULL, &swept));
            const float numbers[3] = {swept.clear_until, swept.contact, swept.at_end.separation};
            uint32_t bits[3];
            memcpy(bits, numbers, sizeof bits);
            printf("%08x %08x %08x %u\n", bits[0], bits[1], bits[2], swept.samples);
        }
    }
    EXPECT(NULL, dibs_tracker_sweep(tracker, NULL, NULL, &swept));
    EXPECT(NULL, dibs_tracker_sweep(tracker, &sweep, NULL, NULL));
    sweep.margin = -1.0f;
    EXPECT(MARGIN, dibs_tracker_sweep(tracker, &sweep, NULL, &swept));
    sweep.margin = 1.5f;
    sweep.t[1] = 1.5f;
    EXPECT(ARGUMENT, dibs_tracker_sweep(tracker, &sweep, NULL, &swept));
    sweep.t[1] = NAN;
    EXPECT(ARGUMENT, dibs_tracker_sweep(tracker, &sweep, NULL, &swept));
    sweep.t[1] = 1.0f;
    sweep.to.radius = -1.0f;
    EXPECT(TOOL_RADIUS, dibs_tracker_sweep(tracker, &sweep, NULL, &swept));
    return summary();
}
