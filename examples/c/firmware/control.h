/* The control tick: pose, query, force, record. */
#ifndef CONTROL_H
#define CONTROL_H

#include "telemetry.h"

/* Makes tracker, reader and fail-safe machine. */
void control_init(void);

/* Runs one tick. */
void control_tick(tick_record *record);

#endif
