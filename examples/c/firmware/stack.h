/* The stack's high-water mark. */
#ifndef STACK_H
#define STACK_H

#include <stdint.h>

/* Paints the stack below the caller. */
void stack_paint(void);

/* Bytes in use since then at the deepest, interrupts included: those whose paint is gone. */
uint32_t stack_used(void);

#endif
