/* The program. */
#ifndef MAIN_H
#define MAIN_H

/* Runs the controller; ends with the run. */
_Noreturn void run(void);

#endif
