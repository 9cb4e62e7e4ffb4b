/* The instrument's pose: on a real robot from its kinematics, here from a script. */
#ifndef INSTRUMENT_H
#define INSTRUMENT_H

#include <dibs.h>
#include <stdint.h>

/*
 * The instrument at a tick: a capsule that enters through a fixed port while its tip circles the surface and, every
 * seven seconds, through its middle. It depends only on the tick, so that runs are reproducible.
 */
dibs_tool instrument(uint32_t tick);

#endif
