/* Records that wait for the line: the control tick adds, the background takes. */
#ifndef QUEUE_H
#define QUEUE_H

#include <stdbool.h>

#include "telemetry.h"

/* Adds a record; false if the queue is full. From the control tick alone. */
bool queue_add(const tick_record *record);

/* Takes the oldest record; false if there is none. From the background alone. */
bool queue_take(tick_record *record);

#endif
