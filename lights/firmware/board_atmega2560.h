/* Arduino Mega 2560: X0 X1 X2 on D11 D12 D13 (so that the LED shows X2), S0 ... S7 on D22 ... D29, interlock on D30. */
#ifndef BOARD_PINS_H
#define BOARD_PINS_H

#define EXACT_OUTPUTS 3
#define EXACT_PORT PORTB
#define EXACT_DDR DDRB
#define EXACT_MASK (1 << 5 | 1 << 6 | 1 << 7) /* PB5 is OC1A, PB6 is OC1B, PB7 is OC1C */

#define INTERLOCK_PORT PORTC
#define INTERLOCK_PIN PINC
#define INTERLOCK_MASK (1 << 7)

#ifndef __ASSEMBLER__
static inline void board_select(uint8_t lines) {
    PORTA = lines;
}

static inline void board_select_as_outputs(void) {
    DDRA = 0xFF;
}
#endif

#endif
