/* Prints answers as text: floats by their bits, so that the outputs of two programs can be compared. */
#ifndef PRINT_H
#define PRINT_H

#include <dibs.h>

void print_floats(const float *values, size_t count);
void print_vec3(dibs_vec3 value);
void print_proximity(const dibs_proximity *found);
/* Facts of a list, and its contacts. */
void print_contacts(dibs_contacts *contacts);
void print_force(const dibs_force *force);

#endif
