/* The surface that comes over a bus: receiver, reader, fail-safe machine. */
#ifndef BUS_H
#define BUS_H

#include <dibs.h>

/* Ends the program where a call that must succeed has not. */
void must(dibs_code code);

void bus_init(dibs_tree *tree, uint32_t vertices);

/* The bus interrupt: one packet, and some of the work that is due. */
void bus_packet(const uint8_t *bytes, size_t length, uint32_t now);

/* The control interrupt: the frame published last, the closest pair on it, and the force. */
void bus_tick(dibs_frame *frame, dibs_query *query, const dibs_tool *tool, uint32_t now);

#endif
