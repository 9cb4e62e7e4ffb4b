#include "stack.h"

#define PAINT 0xCCCCCCCCu

/* From memory.x: the stack grows down from its start to its end. */
extern uint32_t _stack_start[], _stack_end[];

void stack_paint(void) {
    uint32_t *top;
    __asm volatile("mov %0, sp" : "=r"(top));
    for (volatile uint32_t *word = _stack_end; word < top; word++) {
        *word = PAINT;
    }
}

uint32_t stack_used(void) {
    const volatile uint32_t *word = _stack_end;
    while (word < _stack_start && *word == PAINT) {
        word++;
    }
    return (uint32_t)((uintptr_t)_stack_start - (uintptr_t)word);
}
