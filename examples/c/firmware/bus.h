/*
 * Bus reception: from bytes to published frames and statuses.
 *
 * Two contexts use it, one at a time: the bus interrupt calls `bus_byte`, and the background, with that interrupt disabled,
 * `bus_work` and `bus_report`. The control tick, which is above both, reads `bus_seen`.
 */
#ifndef BUS_H
#define BUS_H

#include <dibs.h>
#include <stddef.h>
#include <stdint.h>

/* Counts since the start. Each is exact, but two of them may have been read at different times. */
typedef struct {
    uint32_t bytes;
    uint32_t published;
    uint32_t rejected;
    /* The frame that the background last read completely, and the CRC-32 of its positions; 0 if there is none. */
    uint32_t read_epoch;
    uint32_t read_digest;
} bus_counts;

/* Makes the bus. */
void bus_init(void);

/* Receives one byte, at this control tick. */
void bus_byte(uint8_t byte, uint32_t tick);

/* Does one slice of checking, copying and publishing; without a frame, it checks the tree in flash. */
void bus_work(void);

/* Writes the status for the sender, if one is due at this tick. Returns its length, or 0. */
size_t bus_report(uint32_t tick, uint8_t out[DIBS_STATUS]);

/* The counters of every event, in the order of docs/wire.md. */
void bus_events(uint32_t events[DIBS_EVENTS]);

/* Completed rounds of the check of the tree. */
uint32_t bus_rounds(void);

/* The counts, for the control tick. */
bus_counts bus_seen(void);

#endif
