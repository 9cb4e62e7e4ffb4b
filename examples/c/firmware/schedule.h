/* The two interrupts, and the monitoring of the control tick's deadline. */
#ifndef SCHEDULE_H
#define SCHEDULE_H

#include <dibs.h>
#include <stddef.h>
#include <stdint.h>

#include "telemetry.h"

/* Starts clock and interrupts. */
void schedule_start(void);

/* Stops the interrupts. */
void schedule_stop(void);

/* Does a slice of work on complete frames, and writes the status to send, if one is due. Returns its length, or 0. The
bus interrupt is disabled meanwhile: for some microseconds no byte is received. */
size_t schedule_background(uint8_t status[DIBS_STATUS]);

/* Control ticks run so far. */
uint32_t schedule_ticks(void);

/* Fills in this module's fields of the summary. */
void schedule_sum_up(summary_record *summary);

/* The handlers: of SysTick, and of UART 0. */
void schedule_tick(void);
void schedule_bus(void);

#endif
