/*
 * From an answer's corners to the vertices of the mesh's file.
 *
 *     corners TREE POSITIONS WITHOUT
 *
 * POSITIONS    x, y, z of each vertex in the file's order, 32-bit floats
 * WITHOUT      the same tree without its vertex order
 */
#include "expect.h"

#include <math.h>
#include <string.h>

#define TOOLS 40

MEMORY(tree_memory, DIBS_TREE_SIZE);
MEMORY(without_memory, DIBS_TREE_SIZE);
MEMORY(frame_memory, DIBS_FRAME_SIZE);
MEMORY(query_memory, DIBS_QUERY_SIZE);

int main(int argc, char **argv) {
    size_t length, without_length, size;
    dibs_tree *tree = NULL, *without = NULL;
    dibs_frame *frame = NULL;
    dibs_query *query = NULL;
    dibs_tree_facts facts;
    dibs_proximity found;
    uint32_t number = 0;
    if (argc != 4) {
        return 2;
    }
    unsigned char *bytes = read_file(argv[1], &length);
    float *of_file = (float *)(void *)read_file(argv[2], &size);
    unsigned char *without_bytes = read_file(argv[3], &without_length);
    EXPECT(OK, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, &tree));
    EXPECT(OK, dibs_tree_init(without_memory, sizeof without_memory, without_bytes, without_length, &without));
    EXPECT(OK, dibs_tree_get_facts(tree, &facts));
    EXPECT_THAT(size == facts.file_vertices * 12ul && facts.file_vertices > facts.vertices);
    float *rows = rest_shape(tree, facts.vertices);
    EXPECT(OK, dibs_frame_init(frame_memory, sizeof frame_memory, &frame));
    EXPECT(OK, dibs_frame_set_vertices(frame, rows, facts.vertices, 0.0f));
    EXPECT(OK, dibs_query_init(query_memory, sizeof query_memory, tree, &query));
    for (unsigned at = 0; at < TOOLS; at++) {
        const dibs_vec3 centre = {100.0f * cosf((float)at), 100.0f * sinf((float)at), 3.0f * (float)at};
        const dibs_tool sphere = {centre, centre, 5.0f};
        EXPECT(OK, dibs_query_closest(query, frame, &sphere, NULL, &found));
        for (unsigned corner = 0; corner < 3; corner++) {
            const uint32_t row = found.corners[corner];
            EXPECT(OK, dibs_tree_vertex_number(tree, row, &number));
            EXPECT_THAT(number < facts.file_vertices && memcmp(&of_file[3 * number], &rows[3 * row], 12) == 0);
        }
    }
    EXPECT(ARGUMENT, dibs_tree_vertex_number(tree, facts.vertices, &number));
    EXPECT(ARGUMENT, dibs_tree_vertex_number(tree, UINT32_MAX, &number));
    EXPECT(ARGUMENT, dibs_tree_vertex_number(without, 0, &number));
    EXPECT(NULL, dibs_tree_vertex_number(NULL, 0, &number));
    EXPECT(NULL, dibs_tree_vertex_number(tree, 0, NULL));
    free(rows);
    free(of_file);
    free(bytes);
    free(without_bytes);
    return summary();
}
