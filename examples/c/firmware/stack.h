/* The stack's high-water mark. */
#ifndef STACK_H
#define STACK_H

#include <stdint.h>

/* Paints the stack below the caller. */
void stack_paint(void);

/* Largest use of the stack since then in bytes, including interrupts: the bytes whose paint was overwritten. */
uint32_t stack_used(void);

#endif
