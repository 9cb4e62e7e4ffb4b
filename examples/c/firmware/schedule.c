#include "schedule.h"

#include <stdatomic.h>
#include <stdbool.h>

#include "bus.h"
#include "clock.h"
#include "control.h"
#include "queue.h"
#include "uart.h"

/* Registers of the interrupt controller. UART 0 has interrupt 0. */
#define NVIC_ENABLE (*(volatile uint32_t *)0xE000E100u)
#define NVIC_DISABLE (*(volatile uint32_t *)0xE000E180u)
#define NVIC_PRIORITY ((volatile uint8_t *)0xE000E400u)
#define SYSTEM_PRIORITY ((volatile uint8_t *)0xE000ED18u)
#define BUS 0
/* Index of SysTick (exception 15) in the priorities of the exceptions, which start at number 4. */
#define SYSTICK 11
/* A lower value is more urgent. */
#define CONTROL_PRIORITY 0x00
#define BUS_PRIORITY 0x80

static atomic_uint_least32_t ticks;
/* Clock counts of the control ticks. */
static atomic_uint_least32_t control_counts;
/* Longest section with the bus interrupt disabled, in clock counts. */
static uint32_t bus_masked;

/* When the running tick was due, on the clock; unknown before the first tick. */
static uint32_t due;
static bool is_due_known;
static uint32_t misses, latency, longest, dropped;

static void mask_bus(void) {
    NVIC_DISABLE = 1u << BUS;
    /* The interrupt may still occur until the write has completed. */
    __asm volatile("dsb\n isb" ::: "memory");
}

static void unmask_bus(void) {
    __asm volatile("" ::: "memory");
    NVIC_ENABLE = 1u << BUS;
}

void schedule_start(void) {
    clock_start();
    uart_start_receiving(UART_BUS);
    SYSTEM_PRIORITY[SYSTICK] = CONTROL_PRIORITY;
    NVIC_PRIORITY[BUS] = BUS_PRIORITY;
    unmask_bus();
    clock_start_ticks();
}

void schedule_stop(void) {
    mask_bus();
    clock_stop_ticks();
}

/* The clock minus the control ticks, which delay the bus anyway; false if a tick occurred during the reading. */
static bool own_time(uint32_t *time) {
    const uint32_t control = atomic_load_explicit(&control_counts, memory_order_relaxed);
    *time = clock_now() - control;
    return control == atomic_load_explicit(&control_counts, memory_order_relaxed);
}

size_t schedule_background(uint8_t status[DIBS_STATUS]) {
    uint32_t before, after;
    mask_bus();
    const bool is_begun = own_time(&before);
    bus_work();
    const size_t length = bus_report(schedule_ticks(), status);
    if (own_time(&after) && is_begun && after - before > bus_masked) {
        bus_masked = after - before;
    }
    unmask_bus();
    return length;
}

uint32_t schedule_ticks(void) {
    return atomic_load_explicit(&ticks, memory_order_relaxed);
}

void schedule_sum_up(summary_record *summary) {
    summary->ticks = schedule_ticks();
    summary->deadline_misses = misses;
    summary->latency_counts = latency;
    summary->tick_counts = longest;
    summary->records_dropped = dropped;
    summary->bus_masked_counts = bus_masked;
}

/* Later due times are computed from the first one, so that a tick that never ran is noticed. */
static void meet(uint32_t now, uint32_t late) {
    if (!is_due_known) {
        is_due_known = true;
        due = now - late;
    } else {
        const uint32_t next = due + CLOCK_TICK;
        const uint32_t skipped = (now - next) / CLOCK_TICK;
        misses += skipped;
        due = next + skipped * CLOCK_TICK;
    }
    if (now - due > latency) {
        latency = now - due;
    }
}

void schedule_tick(void) {
    const uint32_t now = clock_now();
    meet(now, clock_since_due());

    tick_record record;
    control_tick(&record);
    if (!queue_add(&record)) {
        dropped++;
    }

    const uint32_t taken = clock_now() - due;
    if (taken > longest) {
        longest = taken;
    }
    if (taken > CLOCK_TICK) {
        misses++;
    }
    atomic_fetch_add_explicit(&ticks, 1, memory_order_relaxed);
    atomic_fetch_add_explicit(&control_counts, clock_now() - now, memory_order_relaxed);
}

void schedule_bus(void) {
    uint8_t byte;
    uart_acknowledge(UART_BUS);
    while (uart_read(UART_BUS, &byte)) {
        bus_byte(byte, schedule_ticks());
    }
}
