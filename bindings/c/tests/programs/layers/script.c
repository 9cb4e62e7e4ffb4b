#include "script.h"

#include <stdio.h>
#include <stdlib.h>

uint8_t *file_read(const char *path, size_t *length) {
    FILE *file = fopen(path, "rb");
    long size = -1;
    uint8_t *bytes = NULL;
    if (file != NULL && fseek(file, 0, SEEK_END) == 0 && (size = ftell(file)) >= 0) {
        rewind(file);
        /* One zero byte more ends a text. */
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

bool take_floats(char **text, float *out, size_t count) {
    for (size_t at = 0; at < count; at++) {
        char *end = *text;
        out[at] = strtof(*text, &end);
        if (end == *text) {
            return false;
        }
        *text = end;
    }
    return true;
}

bool take_tool(char **text, dibs_tool *tool) {
    float numbers[7];
    if (!take_floats(text, numbers, 7)) {
        return false;
    }
    tool->start = (dibs_vec3){numbers[0], numbers[1], numbers[2]};
    tool->end = (dibs_vec3){numbers[3], numbers[4], numbers[5]};
    tool->radius = numbers[6];
    return true;
}

bool take_words(char **text, uint32_t *out, size_t count) {
    for (size_t at = 0; at < count; at++) {
        char *end = *text;
        out[at] = (uint32_t)strtoul(*text, &end, 10);
        if (end == *text) {
            return false;
        }
        *text = end;
    }
    return true;
}

static int digit(char c) {
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

size_t take_bytes(char **text, uint8_t *out, size_t capacity) {
    size_t count = 0;
    char *at = *text;
    while (*at == ' ') {
        at++;
    }
    while (count < capacity && digit(at[0]) >= 0 && digit(at[1]) >= 0) {
        out[count++] = (uint8_t)(digit(at[0]) * 16 + digit(at[1]));
        at += 2;
    }
    *text = at;
    return count;
}
