#include "startup.h"

#include <stddef.h>
#include <stdint.h>

#include "main.h"
#include "schedule.h"
#include "semihosting.h"
#include "stack.h"

/* Coprocessor access control: full access to the FPU's two halves. */
#define CPACR (*(volatile uint32_t *)0xE000ED88u)
#define CPACR_FPU (0xFu << 20)

/* From the linker script. */
extern uint32_t data_start[], data_end[], data_in_flash[], bss_start[], bss_end[], _stack_start[];

/* A fault is broken hardware, a defect or a stack overflow: the program ends, so that a test notices. The stack pointer
may be invalid, so it is reset. */
__attribute__((naked)) static void fault(void) {
    __asm volatile("ldr r0, =_stack_start\n mov sp, r0\n b stop_on_fault");
}

void stop_on_fault(void) {
    semihosting_exit(false);
}

void reset(void) {
    /* This comes first, because with the hard-float convention any function may use the FPU. */
    CPACR |= CPACR_FPU;
    __asm volatile("dsb\n isb" ::: "memory");
    stack_paint();
    for (size_t word = 0; data_start + word < data_end; word++) {
        data_start[word] = data_in_flash[word];
    }
    for (uint32_t *word = bss_start; word < bss_end; word++) {
        *word = 0;
    }
    run();
}

typedef void (*handler)(void);

/* The vector table: the stack, 15 exceptions, and the board's interrupts, of which number 0 is used. */
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    handler exceptions[15];
    handler interrupts[1];
} vectors = {
    .stack = _stack_start,
    .exceptions = {reset, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault,
                   schedule_tick},
    .interrupts = {schedule_bus},
};
