/* For calls that fail only because of a defect in this program. */
#ifndef MUST_H
#define MUST_H

#include <dibs.h>

/* Stops with the code's text unless it is `DIBS_CODE_OK`. On a real robot, make the output safe here. */
void must(dibs_code code);

#endif
