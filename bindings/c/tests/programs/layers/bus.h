/* A surface from the bus: receiver, reader, fail-safe machine. */
#ifndef BUS_H
#define BUS_H

#include <dibs.h>

/* Vertices of the largest surface. */
#define VERTICES 10000

/* Ends the program unless the call succeeded. */
void must(dibs_code code);

void bus_init(dibs_tree *tree, uint32_t vertices);

/* The bus interrupt: takes one packet, and checks the frame as far as it has come. */
void bus_packet(const uint8_t *bytes, size_t length, uint32_t now);

/* The control interrupt: finds the closest pair on the frame published last, and the force. */
void bus_tick(dibs_frame *frame, dibs_query *query, const dibs_tool *tool, uint32_t now);

#endif
