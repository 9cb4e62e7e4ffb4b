/*
 * The control loop on a host computer: executes a script of events. Floats are printed as their bits.
 *
 *     dibs-host TREE SCRIPT
 *
 * TREE    a tree of at most 10,000 vertices, as `dibs build` writes it
 * SCRIPT  lines, with the receiver's clock in ms:
 *     receive NOW BYTES            bytes of a serial line, in hexadecimal
 *     packet NOW BYTES             a packet
 *     frame NOW CAPTURED POSITIONS a frame from this process: x, y and z of each vertex, in the mesh's order
 *     work ROWS                    a slice of the checks
 *     status NOW FRAMED            the status for the sender
 *     tick NOW START END RADIUS    a control tick: a capsule, or a sphere if both ends are equal
 *     touch NOW START END RADIUS   a control tick with the contacts within 5 mm
 *     admit NOW START END RADIUS X a control tick whose command, X mm along x, is filtered
 *     blind NOW                    a control tick without a pose
 *     acknowledge 0                an operator's acknowledgement
 *     counters 0                   the bus's events
 *
 * bindings/c/tests/guard.rs answers the same script in Rust, and compares the bits.
 */
#include <dibs.h>

#include <stdalign.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Vertices of the largest tree. */
#define VERTICES 10000

static alignas(DIBS_ALIGNMENT) uint8_t memory[DIBS_START_SIZE(VERTICES)];
static alignas(DIBS_ALIGNMENT) uint8_t list_memory[DIBS_CONTACTS_SIZE];
static dibs_contacts *list;

static const dibs_wall wall = {
    .stiffness = 1.0f, .damping = 0.002f, .hold_damping = 0.001f, .max_force = 5.0f, .margin = 5.0f};

static void must(dibs_code code) {
    if (code != DIBS_CODE_OK) {
        fprintf(stderr, "%s\n", dibs_code_text(code));
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

static void print_words(const uint32_t *words, size_t count) {
    for (size_t at = 0; at < count; at++) {
        printf(" %u", words[at]);
    }
}

static void print_searched(const dibs_searched_surface *searched) {
    const dibs_tracked *tracked = &searched->tracked;
    print_words(&searched->outcome, 1);
    print_floats(&tracked->proximity.separation, 3);
    print_words(&tracked->is_kept, 2);
    print_floats(&tracked->moved, 1);
    print_words(&tracked->opened, 3);
    print_words(&searched->before, 1);
    print_floats(&searched->t, 3);
    print_floats(&searched->velocity.x, 3);
}

static void print_answer(const dibs_answer *answer) {
    const dibs_proximity *pair = &answer->closest;
    dibs_force force;
    must(dibs_answer_force(answer, &wall, &force));
    print_words(&answer->outcome, 1);
    print_floats(&pair->separation, 3);
    print_words(&pair->side, 2);
    print_floats(&pair->axis_distance, 1);
    print_floats(&pair->point_on_surface.x, 3);
    print_floats(&pair->point_on_tool.x, 3);
    print_floats(&pair->direction.x, 3);
    print_floats(&pair->axis_parameter, 1);
    print_words(&pair->triangle, 1);
    print_words(pair->corners, 3);
    print_floats(pair->barycentric, 3);
    print_words(&pair->node_tests, 2);
    print_floats(&answer->interval.lower, 2);
    print_floats(&answer->velocity.x, 3);
    print_words(&answer->trust.state, 2);
    print_floats(&answer->trust.margin, 1);
    print_words(&answer->trust.waits_for_acknowledgement, 1);
    print_words(&answer->age.is_published, 4);
    print_words(&answer->lag, 1);
    print_words(&answer->link.silence, 6);
    print_words(&(uint32_t){force.state}, 1);
    print_floats(&force.force.x, 3);
    print_searched(&answer->searched);
}

static void print_contacts(void) {
    dibs_contacts_facts facts;
    must(dibs_contacts_get_facts(list, &facts));
    print_words(&facts.count, 1);
    print_floats(&facts.bound, 2);
    for (uint32_t number = 0; number < facts.count; number++) {
        dibs_contact contact;
        must(dibs_contacts_get(list, number, &contact));
        print_floats(&contact.separation, 1);
        print_floats(&contact.normal.x, 3);
        print_words(&contact.triangle, 1);
        print_floats(&contact.velocity.x, 3);
    }
}

static dibs_tool take_tool(char *text) {
    dibs_tool tool;
    float *numbers = &tool.start.x;
    for (size_t at = 0; at < 7; at++) {
        numbers[at] = strtof(text, &text);
    }
    return tool;
}

/* Reads a whole file, and appends a zero. */
static uint8_t *file_read(const char *path, size_t *length) {
    FILE *file = fopen(path, "rb");
    long size = -1;
    uint8_t *bytes = NULL;
    if (file != NULL && fseek(file, 0, SEEK_END) == 0 && (size = ftell(file)) >= 0) {
        rewind(file);
        bytes = calloc((size_t)size + 1, 1);
    }
    if (bytes == NULL || fread(bytes, 1, (size_t)size, file) != (size_t)size) {
        fprintf(stderr, "cannot read %s\n", path);
        exit(EXIT_FAILURE);
    }
    fclose(file);
    *length = (size_t)size;
    return bytes;
}

static uint8_t from_hex(const char *text) {
    const char pair[3] = {text[0], text[1], '\0'};
    return (uint8_t)strtoul(pair, NULL, 16);
}

static void answer_event(dibs_bus *bus, dibs_guard *guard, const char *name, uint32_t now, char *rest) {
    static uint8_t bytes[1 << 16];
    size_t length = 0;
    if (strcmp(name, "tick") == 0) {
        const dibs_tool tool = take_tool(rest);
        dibs_answer answer;
        printf("tick %u", dibs_guard_closest(guard, &tool, now, &answer));
        print_answer(&answer);
    } else if (strcmp(name, "touch") == 0) {
        const dibs_tool tool = take_tool(rest);
        dibs_answer answer;
        printf("tick %u", dibs_guard_contacts(guard, &tool, wall.margin, now, list, &answer));
        print_answer(&answer);
        print_contacts();
    } else if (strcmp(name, "admit") == 0) {
        const dibs_tool tool = take_tool(rest);
        const dibs_filter filter = dibs_filter_of(1.0f, 200.0f);
        const float along = strtof(strrchr(rest, ' '), NULL);
        const dibs_rigid_motion command = {.about = tool.start, .translation = {along, 0.0f, 0.0f}};
        dibs_answer answer;
        dibs_admitted_motion admitted;
        const dibs_code code = dibs_guard_admit(guard, &filter, &tool, &command, now, &answer, &admitted);
        printf("tick 0");
        print_answer(&answer);
        printf(" %u", code);
        if (code == DIBS_CODE_OK) {
            print_words(&(uint32_t){admitted.reason}, 1);
            print_words(&admitted.queries, 2);
            print_floats(&admitted.least_separation, 1);
            print_floats(&admitted.motion.about.x, 9);
        }
    } else if (strcmp(name, "frame") == 0) {
        static float positions[3 * VERTICES];
        const uint32_t captured = (uint32_t)strtoul(rest, &rest, 10);
        uint32_t count = 0;
        while (count < 3 * VERTICES && rest[strspn(rest, " ")] != '\0') {
            positions[count++] = strtof(rest, &rest);
        }
        printf("frame %u", dibs_bus_frame(bus, positions, count / 3, captured, now));
    } else if (strcmp(name, "blind") == 0) {
        dibs_answer answer;
        printf("tick %u", dibs_guard_closest(guard, NULL, now, &answer));
        print_answer(&answer);
    } else if (strcmp(name, "acknowledge") == 0) {
        printf("acknowledge %u", dibs_guard_acknowledge(guard));
    } else if (strcmp(name, "work") == 0) {
        dibs_advance advance = DIBS_ADVANCE_IDLE;
        const dibs_code code = dibs_bus_work(bus, now, &advance);
        printf("work %u %u", code, advance);
    } else if (strcmp(name, "status") == 0) {
        const uint32_t framed = (uint32_t)strtoul(rest, NULL, 10);
        must(dibs_bus_status(bus, now, framed, bytes, DIBS_STATUS, &length));
        printf("status ");
        for (size_t at = 0; at < length; at++) {
            printf("%02x", bytes[at]);
        }
    } else if (strcmp(name, "counters") == 0) {
        uint32_t counters[DIBS_EVENTS];
        must(dibs_bus_counters(bus, counters));
        printf("counters");
        print_words(counters, DIBS_EVENTS);
    } else {
        for (rest += strspn(rest, " "); rest[0] > ' ' && rest[1] > ' '; rest += 2) {
            bytes[length++] = from_hex(rest);
        }
        if (strcmp(name, "packet") == 0) {
            dibs_progress progress = DIBS_PROGRESS_NONE;
            const dibs_code code = dibs_bus_packet(bus, bytes, length, now, &progress);
            printf("packet %u %u", code, progress);
        } else {
            printf("receive %u", dibs_bus_receive(bus, bytes, length, now));
        }
    }
    printf("\n");
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "dibs-host TREE SCRIPT\n");
        return EXIT_FAILURE;
    }
    size_t length, script_length;
    dibs_bus *bus;
    dibs_guard *guard;
    const uint8_t *tree = file_read(argv[1], &length);
    char *script = (char *)file_read(argv[2], &script_length);
    const dibs_guard_limits limits = dibs_guard_limits_of(300.0f, 80);
    must(dibs_start(memory, sizeof memory, tree, length, &limits, &bus, &guard));
    must(dibs_contacts_init(list_memory, sizeof list_memory, &list));
    for (char *line = strtok(script, "\n"); line != NULL; line = strtok(NULL, "\n")) {
        char *rest = line + strcspn(line, " ");
        if (*rest != '\0') {
            *rest++ = '\0';
        }
        const uint32_t now = (uint32_t)strtoul(rest, &rest, 10);
        answer_event(bus, guard, line, now, rest);
    }
    return EXIT_SUCCESS;
}
