#include "uart.h"

#define TRANSMIT_FULL (1u << 0)
#define RECEIVE_FULL (1u << 1)
#define RECEIVE_OVERRUN (1u << 3)
#define TRANSMIT_ENABLE (1u << 0)
#define RECEIVE_ENABLE (1u << 1)
#define RECEIVE_INTERRUPT_ENABLE (1u << 3)
#define RECEIVE_INTERRUPT (1u << 1)
/* 25 MHz / 16, the highest rate. An emulated UART ignores it. */
#define DIVISOR 16u

void uart_start_receiving(uart *port) {
    port->divisor = DIVISOR;
    port->control = TRANSMIT_ENABLE | RECEIVE_ENABLE | RECEIVE_INTERRUPT_ENABLE;
}

void uart_start_sending(uart *port) {
    port->divisor = DIVISOR;
    port->control = TRANSMIT_ENABLE;
}

void uart_acknowledge(uart *port) {
    port->interrupt = RECEIVE_INTERRUPT;
}

bool uart_read(uart *port, uint8_t *byte) {
    if ((port->state & RECEIVE_FULL) == 0) {
        return false;
    }
    *byte = (uint8_t)port->data;
    return true;
}

bool uart_has_overrun(uart *port) {
    return (port->state & RECEIVE_OVERRUN) != 0;
}

void uart_write(uart *port, const uint8_t *bytes, size_t length) {
    for (size_t at = 0; at < length; at++) {
        port->data = bytes[at];
        while ((port->state & TRANSMIT_FULL) != 0) {
        }
    }
}
