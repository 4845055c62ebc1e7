/* The serial port, polled: an interrupt per byte would delay the edges' interrupts. */
#ifndef UART_H
#define UART_H

#include <stdbool.h>
#include <stdint.h>

void uart_start(void);

/* Take a byte that has arrived. Returns false where there is none; `spoiled`: it, or one before it, was lost. */
bool uart_take(uint8_t *byte, bool *spoiled);

/* Give a byte to be sent. Returns false where the port is still busy. */
bool uart_give(uint8_t byte);

#endif
