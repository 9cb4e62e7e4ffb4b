/* Reads a script, a text file of lines. main.c lists their kinds. */
#ifndef SCRIPT_H
#define SCRIPT_H

#include <dibs.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A whole file in memory, aligned for any type. Ends the program if the file cannot be read. */
uint8_t *file_read(const char *path, size_t *length);

/* Takes numbers from *text, and moves *text behind them. Returns false if one is missing. */
bool take_floats(char **text, float *out, size_t count);
bool take_tool(char **text, dibs_tool *tool);
bool take_words(char **text, uint32_t *out, size_t count);

/* Takes bytes in hexadecimal, at most `capacity`. Returns their number. */
size_t take_bytes(char **text, uint8_t *out, size_t capacity);

#endif
