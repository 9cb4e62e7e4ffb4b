/* A checksum of the whole published surface, to be compared with that of the sent one. */
#ifndef FINGERPRINT_H
#define FINGERPRINT_H

#include <dibs.h>
#include <stdint.h>

/* Starts with the latest published frame. */
void fingerprint_begin(dibs_bus *bus);

/* Reads a few rows, and after the last row stores the checksum. */
void fingerprint_step(dibs_bus *bus);

/* Epoch and checksum of the frame last read completely; epoch 0 if there is none. From any context. */
void fingerprint_last(uint32_t *epoch, uint32_t *digest);

#endif
