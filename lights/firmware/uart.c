#include "uart.h"

#include <avr/io.h>

void uart_start(void) {
    UCSR0A = 1 << U2X0;
    UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;
    UBRR0 = 16; /* 115200 baud at 16 MHz with U2X: 2.1 % fast, as on every Arduino */
    UCSR0B = 1 << RXEN0 | 1 << TXEN0;
}

bool uart_take(uint8_t *byte, bool *spoiled) {
    uint8_t status = UCSR0A; /* before UDR0: reading that moves the flags on to the next byte */
    if (!(status & 1 << RXC0)) return false;
    *spoiled = status & (1 << FE0 | 1 << DOR0);
    *byte = UDR0;
    return true;
}

bool uart_give(uint8_t byte) {
    if (!(UCSR0A & 1 << UDRE0)) return false;
    UDR0 = byte;
    return true;
}
