/*
 * Misuse of scenes and trackers returns a code. tests/misuse.rs runs this under the address and the undefined-behaviour
 * sanitizer.
 *
 *     misuse_scene TREE STREAM
 */
#include "expect.h"

MEMORY(tree_memory, DIBS_TREE_SIZE);
MEMORY(frame_memory, DIBS_FRAME_SIZE);
MEMORY(other_frame_memory, DIBS_FRAME_SIZE);
MEMORY(query_memory, DIBS_QUERY_SIZE);
MEMORY(other_query_memory, DIBS_QUERY_SIZE);
MEMORY(contacts_memory, DIBS_CONTACTS_SIZE);
MEMORY(tracker_memory, DIBS_TRACKER_SIZE(502));
MEMORY(other_tracker_memory, DIBS_TRACKER_SIZE(502));
MEMORY(unmade, 64);

static dibs_tree *tree;
static dibs_contacts *contacts;

/* Scenes that are none: no surface or too many, an object twice, an empty frame, no tool. */
static void scenes(const float *positions, uint32_t vertices) {
    dibs_query *query, *other_query;
    dibs_frame *frame, *other_frame;
    dibs_closest closest = {.surface = 99};
    dibs_contacts_facts facts;
    const dibs_tool tools[] = {tool, {tool.end, tool.end, 1.0f}};
    const dibs_tool broken[] = {tool, {tool.start, tool.end, -1.0f}};
    EXPECT(OK, dibs_query_init(query_memory, sizeof query_memory, tree, &query));
    EXPECT(OK, dibs_frame_init(frame_memory, sizeof frame_memory, &frame));
    EXPECT(OK, dibs_frame_set_vertices(frame, positions, vertices, 0.0f));
    EXPECT(OK, dibs_query_init(other_query_memory, sizeof other_query_memory, tree, &other_query));
    EXPECT(OK, dibs_frame_init(other_frame_memory, sizeof other_frame_memory, &other_frame));
    dibs_query *queries[] = {query, other_query};
    dibs_frame *frames[] = {frame, other_frame};
    const dibs_scene scene = {queries, frames, 2, tools, 2};
    dibs_scene wrong;

    EXPECT(NULL, dibs_scene_closest(NULL, NULL, &closest));
    EXPECT(NULL, dibs_scene_closest(&scene, NULL, NULL));
    EXPECT(MISALIGNED, dibs_scene_closest((const dibs_scene *)(const void *)(unmade + 1), NULL, &closest));
    EXPECT(NO_SURFACE, dibs_scene_closest(&scene, NULL, &closest));
    EXPECT(OK, dibs_frame_set_vertices(other_frame, positions, vertices - 1, 0.0f));
    EXPECT(VERTEX_COUNT, dibs_scene_closest(&scene, NULL, &closest));
    EXPECT(OK, dibs_frame_set_vertices(other_frame, positions, vertices, 0.0f));
    EXPECT_THAT(closest.surface == 99);
    EXPECT(OK, dibs_scene_closest(&scene, NULL, &closest));
    EXPECT_THAT(closest.surface < 2 && closest.tool < 2);
#define WRONG(code, field, value) \
    wrong = scene;                \
    wrong.field = (value);        \
    expect(DIBS_CODE_##code, dibs_scene_closest(&wrong, NULL, &closest), #field, __LINE__)
    WRONG(NULL, queries, NULL);
    WRONG(NULL, frames, NULL);
    WRONG(NULL, tools, NULL);
    WRONG(ARGUMENT, surface_count, 0);
    WRONG(ARGUMENT, surface_count, DIBS_SURFACES + 1);
    WRONG(ARGUMENT, surface_count, UINT32_MAX);
    WRONG(ARGUMENT, tool_count, 0);
    WRONG(ARGUMENT, tool_count, DIBS_TOOLS + 1);
    WRONG(TOOL_RADIUS, tools, broken);
    WRONG(IN_USE, queries, ((dibs_query *[]){query, query}));
    WRONG(IN_USE, frames, ((dibs_frame *[]){frame, frame}));
    WRONG(NULL, queries, ((dibs_query *[]){query, NULL}));
    WRONG(NOT_INITIALISED, frames, ((dibs_frame *[]){frame, (dibs_frame *)(void *)unmade}));

    EXPECT(OK, dibs_scene_contacts(&scene, 60.0f, NULL, contacts, NULL));
    EXPECT(OK, dibs_contacts_get_facts(contacts, &facts));
    EXPECT_THAT(facts.count > 0);
    EXPECT(MARGIN, dibs_scene_contacts(&scene, -1.0f, NULL, contacts, NULL));
    EXPECT(OK, dibs_scene_contacts(&scene, 60.0f, NULL, contacts, &closest));
    EXPECT(ARGUMENT, dibs_scene_contacts(&scene, 60.0f, &(dibs_options){.flags = 8}, contacts, NULL));
    /* No contacts are left of the scene before. */
    EXPECT(OK, dibs_contacts_get_facts(contacts, &facts));
    EXPECT_THAT(facts.count == 0);
    EXPECT(NULL, dibs_scene_contacts(&scene, 60.0f, NULL, NULL, NULL));
    /* Every object was given back. */
    EXPECT(OK, dibs_scene_contacts(&scene, 60.0f, NULL, contacts, &closest));
}

/* Trackers without a surface, twice, with another number of vertices. */
static void trackers(const float *positions, uint32_t vertices) {
    dibs_tracker *tracker, *other;
    dibs_frame *frame;
    dibs_tracked tracked;
    dibs_contacts_facts facts;
    const dibs_tool tools[] = {tool, tool};
    EXPECT(STORAGE_SIZE, dibs_tracker_init(tracker_memory, sizeof tracker_memory - 1, tree, &tracker));
    EXPECT(OK, dibs_tracker_init(tracker_memory, sizeof tracker_memory, tree, &tracker));
    EXPECT(OK, dibs_frame_init(frame_memory, sizeof frame_memory, &frame));
    EXPECT(OK, dibs_tracker_init(other_tracker_memory, sizeof other_tracker_memory, tree, &other));
    dibs_tracker *both[] = {tracker, other};
    EXPECT(NO_SURFACE, dibs_tracker_closest(tracker, &tool, NULL, &tracked));
    EXPECT(NO_SURFACE, dibs_tracker_contacts(tracker, &tool, 60.0f, NULL, contacts, NULL));
    EXPECT(NO_SURFACE, dibs_tracker_set_frame(tracker, frame));
    EXPECT(NO_SURFACE, dibs_tracker_closest_on(tracker, frame, &tool, NULL, &tracked));
    EXPECT(OK, dibs_frame_set_vertices(frame, positions, vertices - 1, 0.0f));
    EXPECT(VERTEX_COUNT, dibs_tracker_set_frame(tracker, frame));
    EXPECT(OK, dibs_frame_set_vertices(frame, positions, vertices, 0.5f));
    EXPECT(OK, dibs_tracker_set_frame(tracker, frame));
    EXPECT(OK, dibs_tracker_closest(tracker, &tool, NULL, &tracked));
    EXPECT(ARGUMENT, dibs_tracker_closest_on(tracker, frame, &tool, NULL, &tracked));
    EXPECT(NULL, dibs_tracker_closest_on(tracker, NULL, &tool, NULL, &tracked));
    EXPECT(NULL, dibs_tracker_closest_on(NULL, frame, &tool, NULL, &tracked));
    /* The frame's error is part of the accuracy. */
    EXPECT_THAT(tracked.proximity.accuracy > 0.5f && tracked.proximity.accuracy < 0.6f);

    EXPECT(OK, dibs_tracker_contacts(tracker, &tool, 60.0f, NULL, contacts, NULL));
    EXPECT(OK, dibs_contacts_get_facts(contacts, &facts));
    EXPECT_THAT(facts.count > 0 && facts.accuracy > 0.5f && facts.accuracy < 0.6f);
    EXPECT(NULL, dibs_tracker_contacts(tracker, &tool, 60.0f, NULL, NULL, NULL));
    EXPECT(NULL, dibs_tracker_contacts(NULL, &tool, 60.0f, NULL, contacts, NULL));
    EXPECT(OK, dibs_contacts_get_facts(contacts, &facts));
    EXPECT_THAT(facts.count == 0);
    EXPECT(MARGIN, dibs_tracker_contacts(tracker, &tool, -1.0f, NULL, contacts, NULL));

    EXPECT(NO_SURFACE, dibs_tracker_closest_of(both, tools, 2, NULL, &tracked));
    EXPECT(OK, dibs_tracker_set_frame(other, frame));
    EXPECT(OK, dibs_tracker_closest_of(both, tools, 2, NULL, &tracked));
    EXPECT_THAT(tracked.pair < 2 && tracked.searched >= 1);
    EXPECT(NULL, dibs_tracker_closest_of(NULL, tools, 2, NULL, &tracked));
    EXPECT(NULL, dibs_tracker_closest_of(both, NULL, 2, NULL, &tracked));
    EXPECT(NULL, dibs_tracker_closest_of(both, tools, 2, NULL, NULL));
    EXPECT(ARGUMENT, dibs_tracker_closest_of(both, tools, 0, NULL, &tracked));
    EXPECT(ARGUMENT, dibs_tracker_closest_of(both, tools, DIBS_TOOLS + 1, NULL, &tracked));
    EXPECT(IN_USE, dibs_tracker_closest_of((dibs_tracker *[]){tracker, tracker}, tools, 2, NULL, &tracked));
}

int main(int argc, char **argv) {
    size_t length;
    dibs_tree_facts facts;
    if (argc != 3) {
        return 2;
    }
    unsigned char *bytes = read_file(argv[1], &length);
    EXPECT(OK, dibs_tree_init(tree_memory, sizeof tree_memory, bytes, length, &tree));
    EXPECT(OK, dibs_tree_get_facts(tree, &facts));
    EXPECT(OK, dibs_contacts_init(contacts_memory, sizeof contacts_memory, &contacts));
    float *positions = rest_shape(tree, facts.vertices);
    scenes(positions, facts.vertices);
    trackers(positions, facts.vertices);
    free(positions);
    free(bytes);
    return summary();
}
