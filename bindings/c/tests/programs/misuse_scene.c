/*
 * Misuse of scenes and trackers returns a code. tests/misuse.rs runs this under the address and the undefined-behaviour
 * sanitizer.
 *
 *     misuse_scene TREE STREAM
 */
#include "expect.h"

#include <math.h>

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

    /* The filter: bad input is a code, and nothing is admitted. */
    dibs_filter filter = dibs_filter_of(1.0f, 200.0f);
    dibs_rigid_motion command = {.about = tool.start, .translation = {0.1f, 0.0f, 0.0f}};
    dibs_uncertainty still = {0.0f, 0.0f};
    dibs_motion_row rows[DIBS_FILTER_ROWS + 1] = {0};
    dibs_admitted_motion admitted = {.queries = 77};
#define ADMIT(code, trackers, frame, tools, count, period, row, row_count)                                                 \
    expect(DIBS_CODE_##code,                                                                                               \
           dibs_filter_admit(&filter, trackers, frame, tools, count, &command, period, &still, row, row_count, &admitted), \
           "admit", __LINE__)
    EXPECT(NULL, dibs_filter_admit(NULL, both, NULL, tools, 2, &command, 0.001f, &still, NULL, 0, &admitted));
    EXPECT(NULL, dibs_filter_admit(&filter, both, NULL, tools, 2, NULL, 0.001f, &still, NULL, 0, &admitted));
    EXPECT(NULL, dibs_filter_admit(&filter, both, NULL, tools, 2, &command, 0.001f, NULL, NULL, 0, &admitted));
    EXPECT(NULL, dibs_filter_admit(&filter, both, NULL, tools, 2, &command, 0.001f, &still, NULL, 0, NULL));
    ADMIT(NULL, NULL, NULL, tools, 2, 0.001f, NULL, 0);
    ADMIT(NULL, both, NULL, NULL, 2, 0.001f, NULL, 0);
    ADMIT(NULL, both, NULL, tools, 2, 0.001f, NULL, 1);
    ADMIT(ARGUMENT, both, NULL, tools, 0, 0.001f, NULL, 0);
    ADMIT(ARGUMENT, both, NULL, tools, DIBS_FILTER_TOOLS + 1, 0.001f, NULL, 0);
    ADMIT(ARGUMENT, both, NULL, tools, 2, 0.001f, rows, DIBS_FILTER_ROWS + 1);
    ADMIT(ARGUMENT, both, frame, tools, 2, 0.001f, NULL, 0);
    ADMIT(IN_USE, ((dibs_tracker *[]){tracker, tracker}), NULL, tools, 2, 0.001f, NULL, 0);
    ADMIT(FILTER, both, NULL, tools, 2, 0.0f, NULL, 0);
    ADMIT(FILTER, both, NULL, tools, 2, NAN, NULL, 0);
    rows[0].least = NAN;
    ADMIT(NOT_FINITE, both, NULL, tools, 2, 0.001f, rows, 1);
    const struct { dibs_filter filter; dibs_rigid_motion command; dibs_uncertainty still; dibs_code code; } wrong[] = {
        {dibs_filter_of(-1.0f, 200.0f), command, still, DIBS_CODE_FILTER},
        {dibs_filter_of(NAN, 200.0f), command, still, DIBS_CODE_FILTER},
        {dibs_filter_of(1.0f, 0.0f), command, still, DIBS_CODE_FILTER},
        {{1.0f, 200.0f, 0.5f, 0.0f, 200000, DIBS_COST_M7_TICK, 0.0f, 0, {{0, 0.0f}}}, command, still, DIBS_CODE_FILTER},
        {{1.0f, 200.0f, NAN, 0.0f, 200000, DIBS_COST_M7_TICK, 0.0f, 0, {{0, 0.0f}}}, command, still, DIBS_CODE_FILTER},
        {{1.0f, 200.0f, 0.0f, -0.1f, 200000, DIBS_COST_M7_TICK, 0.0f, 0, {{0, 0.0f}}}, command, still, DIBS_CODE_FILTER},
        {{1.0f, 200.0f, 0.0f, 0.0f, 200000, DIBS_COST_M7_CAPSULE, 0.0f, 0, {{0, 0.0f}}}, command, still, DIBS_CODE_ARGUMENT},
        {{1.0f, 200.0f, 0.0f, 0.0f, 200000, DIBS_COST_M7_TICK, -1.0f, 0, {{0, 0.0f}}}, command, still, DIBS_CODE_ARGUMENT},
        {{1.0f, 200.0f, 0.0f, 0.0f, 200000, DIBS_COST_M7_TICK, 0.0f, 5, {{0, 3.0f}}}, command, still, DIBS_CODE_ARGUMENT},
        {{1.0f, 200.0f, 0.0f, 0.0f, 200000, DIBS_COST_M7_TICK, 0.0f, 1, {{256, 3.0f}}}, command, still, DIBS_CODE_ARGUMENT},
        /* The tree has no labels. */
        {{1.0f, 200.0f, 0.0f, 0.0f, 200000, DIBS_COST_M7_TICK, 0.0f, 1, {{2, 3.0f}}}, command, still, DIBS_CODE_FILTER},
        {{1.0f, 200.0f, 0.0f, 0.0f, 200000, DIBS_COST_M7_TICK, 0.0f, 1, {{2, 0.5f}}}, command, still, DIBS_CODE_FILTER},
        {{1.0f, 200.0f, 0.0f, 0.0f, 200000, DIBS_COST_M7_TICK, 0.0f, 1, {{2, NAN}}}, command, still, DIBS_CODE_FILTER},
        {filter, {.translation = {NAN, 0.0f, 0.0f}}, still, DIBS_CODE_NOT_FINITE},
        {filter, {.rotation = {0.0f, INFINITY, 0.0f}}, still, DIBS_CODE_NOT_FINITE},
        {filter, command, {-0.1f, 0.0f}, DIBS_CODE_FILTER},
        {filter, command, {0.0f, NAN}, DIBS_CODE_FILTER},
    };
    for (size_t at = 0; at < sizeof wrong / sizeof wrong[0]; at++) {
        expect(wrong[at].code, dibs_filter_admit(&wrong[at].filter, both, NULL, tools, 2, &wrong[at].command, 0.001f,
                                                 &wrong[at].still, NULL, 0, &admitted), "wrong", (int)at);
    }
    EXPECT_THAT(admitted.queries == 77);
    ADMIT(OK, both, NULL, tools, 2, 0.001f, NULL, 0);
    EXPECT_THAT(admitted.queries >= 2 && admitted.instructions <= 200000);
    /* A stand-off beyond any room, and a tool that starts in the surface: said, and no pass. */
    dibs_filter beyond = dibs_filter_of(1e6f, 200.0f);
    EXPECT(OK, dibs_filter_admit(&beyond, both, NULL, tools, 2, &command, 0.001f, &still, NULL, 0, &admitted));
    EXPECT_THAT(admitted.reason == DIBS_REASON_NO_SAFE_MOTION);
    dibs_tool within[2] = {tools[0], tools[1]};
    within[0].start = (dibs_vec3){positions[0], positions[1], positions[2]};
    EXPECT(OK, dibs_filter_admit(&filter, both, NULL, within, 2, &command, 0.001f, &still, NULL, 0, &admitted));
    EXPECT_THAT(admitted.reason == DIBS_REASON_NO_SAFE_MOTION && admitted.least_separation < 0.0f);
    /* No budget: what is not verified is not admitted. */
    filter.instructions = 0;
    ADMIT(OK, both, NULL, tools, 2, 0.001f, NULL, 0);
    EXPECT_THAT(admitted.reason == DIBS_REASON_NO_SAFE_MOTION && admitted.motion.translation.x == 0.0f);
    float distance;
    still = (dibs_uncertainty){0.5f, 100.0f};
    EXPECT(NULL, dibs_uncertainty_stand_off(&still, 0.001f, NULL));
    EXPECT(OK, dibs_uncertainty_stand_off(&still, 0.001f, &distance));
    EXPECT_THAT(distance >= 0.6f && distance < 0.6001f);
    dibs_tool moved;
    EXPECT(NULL, dibs_rigid_motion_apply(NULL, &tool, &moved));
    EXPECT(OK, dibs_rigid_motion_apply(&command, &tool, &moved));
    EXPECT_THAT(moved.start.x == tool.start.x + 0.1f && moved.radius == tool.radius);
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
