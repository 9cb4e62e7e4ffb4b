/*
 * The loop with a bus and a guard: answers a script of events. tests/guard.rs compares each line with the Rust library's.
 *
 *     loop TREE SCRIPT
 */
#include "expect.h"

#include <string.h>

MEMORY(memory, DIBS_START_SIZE(502));

static const dibs_wall wall = {1.0f, 0.002f, 0.001f, 5.0f, 5.0f};

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

static void print_words(const uint32_t *words, size_t count) {
    for (size_t at = 0; at < count; at++) {
        printf(" %u", words[at]);
    }
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
}

static unsigned char from_hex(const char *text) {
    const char pair[3] = {text[0], text[1], '\0'};
    return (unsigned char)strtoul(pair, NULL, 16);
}

static void answer_event(dibs_bus *bus, dibs_guard *guard, const char *name, uint32_t now, char *rest) {
    static unsigned char bytes[1 << 16];
    size_t length = 0;
    if (strcmp(name, "tick") == 0) {
        dibs_tool tool;
        dibs_answer answer;
        float *numbers = &tool.start.x;
        for (size_t at = 0; at < 7; at++) {
            numbers[at] = strtof(rest, &rest);
        }
        printf("tick %u", dibs_guard_closest(guard, &tool, now, &answer));
        print_answer(&answer);
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
        const uint32_t framed = strtoul(rest, NULL, 10);
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
    static char line[1 << 18];
    size_t length;
    dibs_bus *bus;
    dibs_guard *guard;
    if (argc != 3) {
        return 2;
    }
    const unsigned char *tree = read_file(argv[1], &length);
    FILE *script = fopen(argv[2], "r");
    const dibs_guard_limits limits = dibs_guard_limits_of(300.0f, 80);
    must(dibs_start(memory, sizeof memory, tree, length, &limits, &bus, &guard));
    while (script != NULL && fgets(line, sizeof line, script) != NULL) {
        char *rest = line;
        const char *name = line;
        rest += strcspn(line, " ");
        *rest++ = '\0';
        const uint32_t now = strtoul(rest, &rest, 10);
        answer_event(bus, guard, name, now, rest);
    }
    return script == NULL ? 2 : EXIT_SUCCESS;
}
