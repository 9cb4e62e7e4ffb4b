/* Records that wait for the telemetry line: the control tick adds them, the background takes them. */
#ifndef QUEUE_H
#define QUEUE_H

#include <stdbool.h>

#include "telemetry.h"

/* Adds a record; false if the queue is full. Only for the control tick. */
bool queue_add(const tick_record *record);

/* Takes the oldest record; false if there is none. Only for the background. */
bool queue_take(tick_record *record);

#endif
