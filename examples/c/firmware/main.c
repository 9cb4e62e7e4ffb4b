/*
 * The controller of the demo in C, for an MPS2-AN500, a Cortex-M7 that QEMU emulates as `mps2-an500`: `cargo xtask demo --c`.
 * firmware-example is the same in Rust, and sends the same records.
 *
 * Three priorities share the core. The control tick (SysTick, 1 kHz) has the highest: only its last run delays it. Bus
 * reception (UART 0) is one below. The idle loop checks complete frames and the tree in flash in slices, and sends
 * statuses over UART 0 and telemetry over UART 1.
 */
#include "main.h"

#include "bus.h"
#include "control.h"
#include "queue.h"
#include "schedule.h"
#include "semihosting.h"
#include "stack.h"
#include "surface.h"
#include "uart.h"

_Noreturn static void send_summary(void) {
    /* This program never disables all interrupts, so `masked_counts` is 0. */
    summary_record summary = {.kind = SUMMARY_KIND};
    schedule_sum_up(&summary);
    summary.bus_overrun = uart_has_overrun(UART_BUS);
    summary.stack_bytes = stack_used();
    summary.scrub_rounds = bus_rounds();
    bus_events(summary.events);
    telemetry_send(&summary, sizeof summary);
    semihosting_exit(summary.deadline_misses == 0);
}

void run(void) {
    tick_record record;
    uint8_t status[DIBS_STATUS];
    const uint32_t length = semihosting_run_length();

    surface_init();
    bus_init();
    control_init();
    uart_start_sending(UART_TELEMETRY);
    schedule_start();
    for (;;) {
        if (queue_take(&record)) {
            telemetry_send(&record, sizeof record);
        } else if (length != 0 && schedule_ticks() >= length) {
            break;
        }
        /* There is always work, so the loop does not sleep: an emulated processor that sleeps loses its exact time. */
        uart_write(UART_BUS, status, schedule_background(status));
    }
    schedule_stop();
    while (queue_take(&record)) {
        telemetry_send(&record, sizeof record);
    }
    send_summary();
}
