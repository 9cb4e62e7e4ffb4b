/* Trackers, and their answers to a tick. */
#ifndef TRACK_H
#define TRACK_H

#include <dibs.h>

void track_init(dibs_tree *tree);

/* Prints the tick's closest pair, the contacts, and the closest pair of a chain. Each frame is taken over once. */
void track(dibs_frame *frame, const dibs_age *age, const dibs_tool *tool);

#endif
