/* What differs between the boards: pins, and how many exact outputs the timer has. Also read by edges.S. */
#ifndef BOARD_H
#define BOARD_H

#include <avr/io.h>

#include "protocol_table.h"

#if defined(__AVR_ATmega328P__)
#include "board_atmega328p.h"
#elif defined(__AVR_ATmega2560__)
#include "board_atmega2560.h"
#else
#error "This firmware knows the ATmega328P (Uno, Nano) and the ATmega2560 (Mega)."
#endif

#define TICKS_PER_MS 2000UL /* Timer1 at 16 MHz / 8 */
#define TICKS_PER_US 2UL

#endif
