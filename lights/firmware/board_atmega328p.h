/* Arduino Uno and Nano: X0 X1 on D9 D10, S0 ... S7 on D2 ... D7 A0 A1, interlock on A2, LED on D13. */
#ifndef BOARD_PINS_H
#define BOARD_PINS_H

#define EXACT_OUTPUTS 2
#define EXACT_PORT PORTB
#define EXACT_DDR DDRB
#define EXACT_MASK (1 << 1 | 1 << 2) /* PB1 is OC1A, PB2 is OC1B */

#define INTERLOCK_PORT PORTC
#define INTERLOCK_PIN PINC
#define INTERLOCK_MASK (1 << 2)

#define LED_PORT PORTB
#define LED_DDR DDRB
#define LED_MASK (1 << 5)

#ifndef __ASSEMBLER__
/* Selection lines 0 to 5 are PD2 ... PD7, 6 and 7 are PC0 and PC1. The other bits of both ports stay as they are. */
static inline void board_select(uint8_t lines) {
    PORTD = (PORTD & 0x03) | (uint8_t)(lines << 2);
    PORTC = (PORTC & 0xFC) | (lines >> 6);
}

static inline void board_select_as_outputs(void) {
    DDRD |= 0xFC;
    DDRC |= 0x03;
}
#endif

#endif
