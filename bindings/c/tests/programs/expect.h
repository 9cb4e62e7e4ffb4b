/* Checks of codes, for the programs that misuse the library. */
#ifndef EXPECT_H
#define EXPECT_H

#include <dibs.h>

#include <stdalign.h>
#include <stdio.h>
#include <stdlib.h>

static unsigned failures;
static unsigned checks;

static inline void expect(dibs_code expected, dibs_code found, const char *call, int line) {
    checks++;
    if (expected != found) {
        failures++;
        printf("line %d: %s\n    is %u (%s), not %u\n", line, call, found, dibs_code_text(found), expected);
    }
}

#define EXPECT_THAT(is_so) expect(DIBS_CODE_OK, (is_so) ? DIBS_CODE_OK : DIBS_CODE_ARGUMENT, #is_so, __LINE__)
#define EXPECT(code, call) expect(DIBS_CODE_##code, call, #call, __LINE__)

/* Each object has an array of its own: the sanitizer sees a write behind its end. */
#define MEMORY(name, size) static alignas(DIBS_ALIGNMENT) unsigned char name[size]

static const dibs_tool tool = {{100.0f, 0.0f, 20.0f}, {140.0f, 0.0f, 50.0f}, 2.5f};

#define LONGEST_FILE ((size_t)1 << 24)

static inline unsigned char *read_file(const char *path, size_t *length) {
    FILE *file = fopen(path, "rb");
    unsigned char *bytes = malloc(LONGEST_FILE);
    if (file == NULL || bytes == NULL) {
        exit(2);
    }
    *length = fread(bytes, 1, LONGEST_FILE, file);
    fclose(file);
    /* The exact length: the sanitizer finds a read behind it. */
    return realloc(bytes, *length);
}

/* Positions of a tree's rest shape. */
static inline float *rest_shape(dibs_tree *tree, uint32_t vertices) {
    float *positions = malloc(vertices * 3 * sizeof(float));
    for (uint32_t row = 0; row < vertices; row++) {
        dibs_vec3 at = {0};
        EXPECT(OK, dibs_tree_rest_position(tree, row, &at));
        positions[3 * row] = at.x;
        positions[3 * row + 1] = at.y;
        positions[3 * row + 2] = at.z;
    }
    return positions;
}

/* Prints the counts. Returns the program's exit code. */
static inline int summary(void) {
    printf("%u checks, %u failures\n", checks, failures);
    return failures == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}

#endif
