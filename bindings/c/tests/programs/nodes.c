/*
 * Queries on a surface that nodes carry. tests/nodes.rs compares each line with the Rust library's.
 *
 *     nodes TREE FRAMES
 *
 * FRAMES    x, y, z of each node, 32-bit floats, frame after frame
 */
#include "expect.h"

#include <string.h>

#define NODES 80
#define FRAMES 12

MEMORY(tree_memory, DIBS_TREE_SIZE);
MEMORY(frame_memory, DIBS_FRAME_SIZE);
MEMORY(query_memory, DIBS_QUERY_SIZE);

static void print_floats(const float *values, size_t count) {
    for (size_t at = 0; at < count; at++) {
        uint32_t bits;
        memcpy(&bits, &values[at], sizeof bits);
        printf("%08x ", bits);
    }
}

int main(int argc, char **argv) {
    static alignas(float) unsigned char frames[FRAMES][NODES * 12];
    size_t length;
    dibs_tree *tree = NULL;
    dibs_frame *frame = NULL;
    dibs_query *query = NULL;
    dibs_tree_facts of_tree;
    dibs_frame_facts facts;
    dibs_proximity found;
    FILE *file = argc == 3 ? fopen(argv[2], "rb") : NULL;
    if (file == NULL || fread(frames, 1, sizeof frames, file) != sizeof frames) {
        return 2;
    }
    const unsigned char *bytes = read_file(argv[1], &length);
    EXPECT(OK, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, &tree));
    EXPECT(OK, dibs_tree_get_facts(tree, &of_tree));
    EXPECT_THAT(of_tree.rows == NODES && of_tree.vertices > NODES);
    EXPECT(OK, dibs_frame_init(frame_memory, sizeof frame_memory, &frame));
    EXPECT(OK, dibs_query_init(query_memory, sizeof query_memory, tree, &query));
    const float *first = (const float *)(const void *)frames[0];
    EXPECT(VERTEX_COUNT, dibs_frame_set_nodes(frame, tree, first, NODES - 1, 0.0f));
    EXPECT(ARGUMENT, dibs_frame_set_nodes(frame, tree, first, NODES, -1.0f));
    EXPECT(NULL, dibs_frame_set_nodes(frame, NULL, first, NODES, 0.0f));
    EXPECT(NULL, dibs_frame_set_nodes(frame, tree, NULL, NODES, 0.0f));
    /* Nodes that are taken for vertices are too few. */
    const dibs_tool tool = {{90.0f, 10.0f, 20.0f}, {120.0f, 10.0f, 40.0f}, 2.5f};
    EXPECT(OK, dibs_frame_set_vertices(frame, first, NODES, 0.0f));
    EXPECT(VERTEX_COUNT, dibs_query_closest(query, frame, &tool, NULL, &found));
    for (size_t at = 0; at < FRAMES; at++) {
        float stretch = 0.0f;
        const float *nodes = (const float *)(const void *)frames[at];
        EXPECT(OK, dibs_frame_set_nodes(frame, tree, nodes, NODES, 0.25f));
        EXPECT(OK, dibs_frame_measure(frame, tree, &stretch));
        EXPECT(OK, dibs_frame_get_facts(frame, &facts));
        EXPECT_THAT(facts.vertices == of_tree.vertices);
        EXPECT(OK, dibs_query_closest(query, frame, &tool, NULL, &found));
        print_floats(&stretch, 1);
        print_floats(&facts.position_error, 1);
        print_floats(&found.separation, 3);
        printf("%u\n", found.node_tests);
    }
    return summary();
}
