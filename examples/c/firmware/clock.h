/* The board's two clocks, 25 MHz each: TIMER 0 runs free, SysTick requests the control tick. */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdint.h>

/* Counts between two control ticks: 1 ms. */
#define CLOCK_TICK 25000u

/* Starts the free-running clock. */
void clock_start(void);

/* Counts since the start; wraps after 171 s. */
uint32_t clock_now(void);

/* Starts the control ticks. */
void clock_start_ticks(void);

/* Stops them. */
void clock_stop_ticks(void);

/* Counts since the last tick was due. */
uint32_t clock_since_due(void);

#endif
