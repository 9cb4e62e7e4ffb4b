/* The control tick: from a pose to an answer, a force and a record. */
#ifndef CONTROL_H
#define CONTROL_H

#include "telemetry.h"

/* Makes the guard. */
void control_init(void);

/* Runs one tick. */
void control_tick(tick_record *record);

#endif
