#include "track.h"

#include <stdalign.h>
#include <stdio.h>

#include "bus.h"
#include "print.h"

#define MARGIN 8.0f

/* One for the closest pair, one for the contacts, and one for each tool of the chain. */
enum { CLOSEST, TOUCH, CHAIN, TRACKERS = CHAIN + 2 };

static alignas(DIBS_ALIGNMENT) uint8_t memory[TRACKERS][DIBS_TRACKER_SIZE(VERTICES)];
static alignas(DIBS_ALIGNMENT) uint8_t contacts_memory[DIBS_CONTACTS_SIZE];

static dibs_tracker *trackers[TRACKERS];
static dibs_contacts *contacts;
/* Epoch of the trackers' frame. */
static uint32_t tracked;

void track_init(dibs_tree *tree) {
    for (size_t at = 0; at < TRACKERS; at++) {
        must(dibs_tracker_init(memory[at], sizeof memory[at], tree, &trackers[at]));
    }
    must(dibs_contacts_init(contacts_memory, sizeof contacts_memory, &contacts));
}

/* Contacts of the tool, and at times of a sphere. */
static void touch(dibs_tool tool, uint32_t number) {
    dibs_tracked found;
    if (number / 8 % 2 == 1) {
        tool.end = tool.start;
    }
    must(dibs_tracker_contacts(trackers[TOUCH], &tool, MARGIN, NULL, contacts, &found));
    printf("touch %u", found.fallback);
    print_proximity(&found.proximity);
    print_contacts(contacts);
    printf("\n");
}

/* The tool, and the one before it in a chain. */
static void chain(dibs_tool tool) {
    const dibs_vec3 far = {tool.end.x + 20.0f, tool.end.y - 30.0f, tool.end.z + 10.0f};
    const dibs_tool tools[] = {{.start = far, .end = tool.end, .radius = tool.radius}, tool};
    dibs_tracked found;
    must(dibs_tracker_closest_of(&trackers[CHAIN], tools, 2, NULL, &found));
    printf("chain %u %u %u", found.pair, found.searched, found.fallback);
    print_proximity(&found.proximity);
    printf("\n");
}

void track(dibs_frame *frame, const dibs_age *age, const dibs_tool *tool) {
    static uint32_t ticks;
    dibs_tracked found;
    if (tracked != age->epoch) {
        for (size_t at = 0; at < TRACKERS; at++) {
            must(dibs_tracker_set_frame(trackers[at], frame));
        }
        tracked = age->epoch;
    }
    must(dibs_tracker_closest(trackers[CLOSEST], tool, NULL, &found));
    printf("track %u", found.fallback);
    print_proximity(&found.proximity);
    printf("\n");
    touch(*tool, ticks++);
    chain(*tool);
}
