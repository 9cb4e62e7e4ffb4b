/*
 * Bus reception: bytes in, published frames and statuses out.
 *
 * Two contexts use it, one at a time: the bus interrupt calls `bus_byte`, and the background, with that interrupt disabled,
 * `bus_work` and `bus_report`. The control tick, which is above both, reads `bus_seen`.
 */
#ifndef BUS_H
#define BUS_H

#include <dibs.h>
#include <stddef.h>
#include <stdint.h>

/* Counts since the start. Each is exact, but two of them may be of different moments. */
typedef struct {
    uint32_t bytes;
    uint32_t published;
    uint32_t rejected;
    /* The frame that the background last read in full, and the CRC-32 of its positions; 0 while there is none. */
    uint32_t read_epoch;
    uint32_t read_digest;
} bus_counts;

/* Makes the bus. */
void bus_init(void);

/* Takes one byte at this control tick. */
void bus_byte(uint8_t byte, uint32_t tick);

/* Does one slice of checking, copying and publishing; without a frame, of the check of the tree in flash. */
void bus_work(void);

/* Writes the status for the sender, if one is due at this tick; its length, or 0. */
size_t bus_report(uint32_t tick, uint8_t out[DIBS_STATUS]);

/* The counters of every event, in the order of docs/wire.md. */
void bus_events(uint32_t events[DIBS_EVENTS]);

/* Whole rounds of the check of the tree. */
uint32_t bus_rounds(void);

/* What the control tick reads. */
bus_counts bus_seen(void);

#endif
