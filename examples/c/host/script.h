/* A script: a text file, read line by line. main.c says which lines there are. */
#ifndef SCRIPT_H
#define SCRIPT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A whole file in memory, aligned for any type. Ends the program where it cannot be read. */
uint8_t *file_read(const char *path, size_t *length);

/* Numbers of a line, from *text on, which is moved behind them; false where one is missing. */
bool take_floats(char **text, float *out, size_t count);
bool take_words(char **text, uint32_t *out, size_t count);

/* Bytes in hexadecimal, at most `capacity`; their number. */
size_t take_bytes(char **text, uint8_t *out, size_t capacity);

#endif
