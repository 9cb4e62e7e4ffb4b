/* The instrument's pose: on a robot from the kinematics, here from a script. */
#ifndef INSTRUMENT_H
#define INSTRUMENT_H

#include <dibs.h>
#include <stdint.h>

/*
 * The instrument at a tick: a capsule that enters through a fixed port, while its tip sweeps around the surface and, every
 * seven seconds, through the middle of it. It depends on the tick alone, so that runs repeat.
 */
dibs_tool instrument(uint32_t tick);

#endif
