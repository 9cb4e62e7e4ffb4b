/* The CMSDK UART: one byte deep in each direction. */
#ifndef UART_H
#define UART_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef volatile struct {
    uint32_t data;
    uint32_t state;
    uint32_t control;
    uint32_t interrupt;
    uint32_t divisor;
} uart;

/* UART 0: vertices arrive here, by interrupt 0; statuses leave. */
#define UART_BUS ((uart *)0x40004000u)
/* UART 1: telemetry leaves here. */
#define UART_TELEMETRY ((uart *)0x40005000u)

/* Enables both directions: an arriving byte requests an interrupt. */
void uart_start_receiving(uart *port);

/* Enables sending. */
void uart_start_sending(uart *port);

/* Acknowledges the receive interrupt. Call it before reading: otherwise interrupts are lost. */
void uart_acknowledge(uart *port);

/* The received byte; false if there is none. */
bool uart_read(uart *port, uint8_t *byte);

/* Whether a byte was ever lost because the previous one was not read in time. */
bool uart_has_overrun(uart *port);

/* Sends bytes, and waits until each is sent: an emulator that ends would lose a waiting byte. */
void uart_write(uart *port, const uint8_t *bytes, size_t length);

#endif
