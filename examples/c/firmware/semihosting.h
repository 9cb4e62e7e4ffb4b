/* The debugger's services: the length of a run, a message, and the end. Without a debugger a `bkpt` is a fault, so
remove this on real hardware. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdbool.h>
#include <stdint.h>

/* Prints a text through the debugger. */
void semihosting_print(const char *text);

/* Ticks to run: the digits at the end of the command line; 0 (for ever) if there are none. */
uint32_t semihosting_run_length(void);

/* Ends the emulation with exit code 0 or 1. */
_Noreturn void semihosting_exit(bool is_well);

#endif
