/* Calls that fail only by a mistake in this program. */
#ifndef MUST_H
#define MUST_H

#include <dibs.h>

/* Stops with the code's sentence unless it is `DIBS_CODE_OK`. A robot makes its output safe here. */
void must(dibs_code code);

#endif
