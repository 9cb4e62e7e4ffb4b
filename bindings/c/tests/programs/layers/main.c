/*
 * The layers below bus and guard: answers a script of surfaces, poses, packets and control ticks. Floats are printed by
 * their bits:
 *
 *     layers TREE FRAMES SCRIPT
 *
 * TREE    a tree, as `dibs build` writes it
 * FRAMES  x, y, z of each vertex, 32-bit floats, in the tree's order of rows, frame after frame
 * SCRIPT  lines:
 *     frame NUMBER                       the surface is this frame of FRAMES
 *     pose START END RADIUS BUDGET FLAGS
 *                                        a capsule, a budget, the options' flags
 *     scene NUMBER BUDGET FLAGS TOOL...
 *                                        a chain of capsules, this surface and that of another frame
 *     packet NOW BYTES                   a packet from the bus, in hexadecimal
 *     tick NOW START END RADIUS          a control tick, with the surface from the bus
 *
 * tests/layers.rs answers the same script in Rust, and compares the bits.
 */
#include <dibs.h>

#include <stdalign.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bus.h"
#include "print.h"
#include "script.h"

#define MARGIN 8.0f

/* Memory of the objects: the library allocates nothing. */
static alignas(DIBS_ALIGNMENT) uint8_t tree_memory[DIBS_TREE_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t frame_memory[DIBS_FRAME_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t query_memory[DIBS_QUERY_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t other_frame_memory[DIBS_FRAME_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t other_query_memory[DIBS_QUERY_SIZE];
static alignas(DIBS_ALIGNMENT) uint8_t contacts_memory[DIBS_CONTACTS_SIZE];

static dibs_tree *tree;
/* The surface, and the second one of a scene. */
static dibs_frame *frame, *other_frame;
static dibs_query *query, *other_query;
static dibs_contacts *contacts;

static const dibs_wall wall = {
    .stiffness = 1.0f, .damping = 0.002f, .hold_damping = 0.002f, .max_force = 5.0f, .margin = MARGIN};

void must(dibs_code code) {
    if (code != DIBS_CODE_OK) {
        fprintf(stderr, "%s\n", dibs_code_text(code));
        exit(EXIT_FAILURE);
    }
}

/* All contacts, their rows, and their joint force on the tool. */
static void print_touch(dibs_code code, const dibs_tool *tool, dibs_vec3 velocity) {
    print_contacts(contacts);
    dibs_row rows[DIBS_CONTACTS];
    size_t count;
    must(dibs_contacts_rows(contacts, tool->start, 1.0f, 20.0f, DIBS_CONTACTS, rows, &count));
    for (size_t number = 0; number < count; number++) {
        print_floats(rows[number].linear, 3);
        print_floats(rows[number].angular, 3);
        print_floats(&rows[number].least, 1);
    }
    dibs_force force;
    const dibs_vec3 angular = {0.0f, 0.1f, 0.0f};
    must(dibs_wall_proxy_force(&wall, code, contacts, tool->start, velocity, angular, &force));
    print_force(&force);
}

static void answer(const dibs_tool *tool, const dibs_options *options) {
    const dibs_vec3 velocity = {10.0f, -20.0f, 5.0f};
    dibs_proximity found;
    dibs_force force;
    dibs_code code = dibs_query_closest(query, frame, tool, options, &found);
    printf("closest %u", code);
    if (code == DIBS_CODE_OK) {
        print_proximity(&found);
    }
    /* After an error the force is the hold, so there is always a force. */
    must(dibs_wall_force(&wall, code, &found, velocity, &force));
    print_force(&force);

    code = dibs_query_contacts(query, frame, tool, MARGIN, options, contacts, NULL);
    printf(" contacts %u", code);
    print_touch(code, tool, velocity);
    printf("\n");
}

static bool take_options(char **text, dibs_options *options) {
    uint32_t words[2];
    if (!take_words(text, words, 2)) {
        return false;
    }
    options->budget = words[0];
    options->flags = words[1];
    return true;
}

static bool pose(char *text) {
    dibs_tool tool;
    dibs_options options = {.depth_tolerance = 0.0f};
    if (!take_tool(&text, &tool) || !take_options(&text, &options)) {
        return false;
    }
    answer(&tool, &options);
    return true;
}

/* Makes a frame of the file the surface in `into`. */
static bool surface(char **text, dibs_frame *into, const float *frames, size_t length, uint32_t vertices) {
    uint32_t number;
    const size_t floats = 3 * (size_t)vertices;
    if (!take_words(text, &number, 1) || (number + 1) * floats * sizeof(float) > length) {
        return false;
    }
    must(dibs_frame_set_vertices(into, frames + number * floats, vertices, 0.0f));
    must(dibs_frame_measure(into, tree, NULL));
    return true;
}

/* The closest pair and the contacts of a chain, this surface and that of another frame. */
static bool scene(char *text, const float *frames, size_t length, uint32_t vertices) {
    dibs_query *queries[] = {query, other_query};
    dibs_frame *surfaces[] = {frame, other_frame};
    dibs_tool tools[DIBS_TOOLS];
    dibs_scene scene = {.queries = queries, .frames = surfaces, .surface_count = 2, .tools = tools};
    dibs_options options = {.depth_tolerance = 0.0f};
    if (!surface(&text, other_frame, frames, length, vertices) || !take_options(&text, &options)) {
        return false;
    }
    while (scene.tool_count < DIBS_TOOLS && take_tool(&text, &tools[scene.tool_count])) {
        scene.tool_count++;
    }
    dibs_closest closest;
    const dibs_code code = dibs_scene_closest(&scene, &options, &closest);
    printf("scene %u %u %u", code, closest.surface, closest.tool);
    print_proximity(&closest.proximity);
    printf(" contacts %u", dibs_scene_contacts(&scene, MARGIN, &options, contacts, &closest));
    printf(" %u %u", closest.surface, closest.tool);
    print_proximity(&closest.proximity);
    print_contacts(contacts);
    printf("\n");
    return true;
}

static bool packet(char *text) {
    static uint8_t bytes[DIBS_MTU];
    uint32_t now;
    if (!take_words(&text, &now, 1)) {
        return false;
    }
    bus_packet(bytes, take_bytes(&text, bytes, sizeof bytes), now);
    return true;
}

static bool tick(char *text) {
    dibs_tool tool;
    uint32_t now;
    if (!take_words(&text, &now, 1) || !take_tool(&text, &tool)) {
        return false;
    }
    bus_tick(frame, query, &tool, now);
    return true;
}

int main(int argc, char **argv) {
    if (argc != 4) {
        fprintf(stderr, "layers TREE FRAMES SCRIPT\n");
        return EXIT_FAILURE;
    }
    size_t tree_length, frames_length, script_length;
    const uint8_t *bytes = file_read(argv[1], &tree_length);
    const float *frames = (const float *)(const void *)file_read(argv[2], &frames_length);
    char *script = (char *)file_read(argv[3], &script_length);

    dibs_tree_facts facts;
    must(dibs_tree_init(tree_memory, sizeof tree_memory, bytes, tree_length, &tree));
    must(dibs_tree_get_facts(tree, &facts));
    must(dibs_frame_init(frame_memory, sizeof frame_memory, &frame));
    must(dibs_query_init(query_memory, sizeof query_memory, tree, &query));
    must(dibs_frame_init(other_frame_memory, sizeof other_frame_memory, &other_frame));
    must(dibs_query_init(other_query_memory, sizeof other_query_memory, tree, &other_query));
    must(dibs_contacts_init(contacts_memory, sizeof contacts_memory, &contacts));

    bus_init(tree, facts.vertices);

    for (char *line = strtok(script, "\n"); line != NULL; line = strtok(NULL, "\n")) {
        const size_t word = strcspn(line, " ");
        char *rest = line + word;
        bool is_known = (strncmp(line, "frame", word) == 0
                         && surface(&rest, frame, frames, frames_length, facts.vertices))
            || (strncmp(line, "pose", word) == 0 && pose(rest))
            || (strncmp(line, "scene", word) == 0 && scene(rest, frames, frames_length, facts.vertices))
            || (strncmp(line, "packet", word) == 0 && packet(rest))
            || (strncmp(line, "tick", word) == 0 && tick(rest));
        if (!is_known) {
            fprintf(stderr, "not a line of a script: %.40s\n", line);
            return EXIT_FAILURE;
        }
    }
    return EXIT_SUCCESS;
}
