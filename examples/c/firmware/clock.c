#include "clock.h"

typedef volatile struct {
    uint32_t control;
    uint32_t value;
    uint32_t reload;
} timer;

#define TIMER0 ((timer *)0x40000000u)

typedef volatile struct {
    uint32_t control;
    uint32_t reload;
    uint32_t value;
} systick;

#define SYSTICK ((systick *)0xE000E010u)
#define SYSTICK_ENABLE (1u << 0)
#define SYSTICK_INTERRUPT (1u << 1)
#define SYSTICK_CORE_CLOCK (1u << 2)

void clock_start(void) {
    TIMER0->reload = UINT32_MAX;
    TIMER0->value = UINT32_MAX;
    TIMER0->control = 1;
}

uint32_t clock_now(void) {
    /* It counts down. */
    return ~TIMER0->value;
}

void clock_start_ticks(void) {
    SYSTICK->reload = CLOCK_TICK - 1;
    SYSTICK->value = 0;
    SYSTICK->control = SYSTICK_CORE_CLOCK | SYSTICK_INTERRUPT | SYSTICK_ENABLE;
}

void clock_stop_ticks(void) {
    SYSTICK->control = 0;
}

uint32_t clock_since_due(void) {
    return (CLOCK_TICK - SYSTICK->value) % CLOCK_TICK;
}
