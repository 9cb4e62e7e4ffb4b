/* From reset to the program. */
#ifndef STARTUP_H
#define STARTUP_H

/* The first code after reset. */
_Noreturn void reset(void);

/* The end of every fault. */
_Noreturn void stop_on_fault(void);

#endif
