/* A checksum of the whole published surface, to compare it with the one sent. */
#ifndef FINGERPRINT_H
#define FINGERPRINT_H

#include <dibs.h>
#include <stdint.h>

/* Starts anew with the frame just published. */
void fingerprint_begin(dibs_bus *bus);

/* Reads a few rows, and after the last one notes the checksum. */
void fingerprint_step(dibs_bus *bus);

/* Epoch and checksum of the frame last read in full; epoch 0 while there is none. From any context. */
void fingerprint_last(uint32_t *epoch, uint32_t *digest);

#endif
