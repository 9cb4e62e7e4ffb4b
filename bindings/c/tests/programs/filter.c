/*
 * A chain of two capsules that is commanded against a moving surface. tests/filter.rs compares each line with the Rust
 * library's.
 *
 *     filter TREE FRAMES COMMANDS
 *
 * FRAMES    x, y, z of each vertex, 32-bit floats, frame after frame
 * COMMANDS  lines: the number of the frame, translation and rotation of the command, whether the caller's row holds
 */
#include "expect.h"

#include <string.h>

#define VERTICES 502

MEMORY(tree_memory, DIBS_TREE_SIZE);
MEMORY(frame_memory, DIBS_FRAME_SIZE);
static alignas(DIBS_ALIGNMENT) unsigned char tracker_memory[2][DIBS_TRACKER_SIZE(VERTICES)];

static void must(dibs_code code) {
    if (code != DIBS_CODE_OK) {
        printf("%s\n", dibs_code_text(code));
        exit(EXIT_FAILURE);
    }
}

static void print_floats(const float *values, size_t count) {
    for (size_t at = 0; at < count; at++) {
        uint32_t bits;
        memcpy(&bits, &values[at], sizeof bits);
        printf(" %08x", bits);
    }
}

int main(int argc, char **argv) {
    static char line[1 << 10];
    static unsigned char frames[VERTICES * 12 * 32];
    size_t length;
    dibs_tree *tree;
    dibs_frame *frame;
    dibs_tracker *trackers[2];
    dibs_tool tools[2] = {{{110.0f, 3.0f, 60.0f}, {110.0f, 80.0f, 90.0f}, 2.5f},
                          {{110.0f, 80.0f, 90.0f}, {150.0f, 90.0f, 120.0f}, 4.0f}};
    if (argc != 4) {
        return 2;
    }
    const unsigned char *bytes = read_file(argv[1], &length);
    FILE *file = fopen(argv[2], "rb");
    FILE *commands = fopen(argv[3], "r");
    if (file == NULL || commands == NULL || fread(frames, 1, sizeof frames, file) == 0) {
        return 2;
    }
    must(dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, &tree));
    must(dibs_frame_init(frame_memory, sizeof frame_memory, &frame));
    for (size_t at = 0; at < 2; at++) {
        must(dibs_tracker_init(tracker_memory[at], sizeof tracker_memory[at], tree, &trackers[at]));
    }
    dibs_filter filter = dibs_filter_of(1.0f, 400.0f);
    const dibs_uncertainty uncertainty = {.now = 0.05f, .speed = 20.0f};
    uint32_t last = UINT32_MAX;
    for (uint32_t tick = 0; fgets(line, sizeof line, commands) != NULL; tick++) {
        char *rest = line;
        const uint32_t number = (uint32_t)strtoul(rest, &rest, 10);
        dibs_rigid_motion command = {.about = tools[1].end};
        float *values = &command.translation.x;
        for (size_t at = 0; at < 6; at++) {
            values[at] = strtof(rest, &rest);
        }
        const dibs_motion_row row = {.linear = {0.0f, 1.0f, 0.0f}, .least = -0.02f};
        const uint32_t rows = (uint32_t)strtoul(rest, &rest, 10);
        if (number != last) {
            const float *positions = (const float *)(const void *)(frames + number * VERTICES * 12);
            must(dibs_frame_set_vertices(frame, positions, VERTICES, 0.0f));
            for (size_t at = 0; at < 2; at++) {
                must(dibs_tracker_set_frame(trackers[at], frame));
            }
            last = number;
        }
        /* A small budget now and then, a slow approach, and a lever of the caller's. */
        filter.approach = tick % 3 == 2 ? 0.02f : 0.0f;
        filter.instructions = tick % 5 == 4 ? 30000 : 200000;
        filter.lever = tick % 7 == 6 ? 50.0f : 0.0f;
        /* A larger stand-off from the vessel. */
        filter.label_count = tick % 4 == 3 ? 0 : 1;
        filter.labels[0] = (dibs_stand_off_of){.label = 2, .stand_off = 3.0f};
        dibs_admitted_motion admitted;
        must(dibs_filter_admit(&filter, trackers, NULL, tools, 2, &command, 0.001f, &uncertainty, &row, rows, &admitted));
        printf("%u %u %u", admitted.reason, admitted.queries, admitted.instructions);
        print_floats(&admitted.least_separation, 1);
        print_floats(&admitted.motion.about.x, 9);
        for (size_t at = 0; at < 2; at++) {
            must(dibs_rigid_motion_apply(&admitted.motion, &tools[at], &tools[at]));
            print_floats(&tools[at].start.x, 7);
        }
        printf("\n");
    }
    return EXIT_SUCCESS;
}
