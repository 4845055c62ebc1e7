/* Arduino Mega 2560: X0 X1 X2 on D6 D7 D8, S0 ... S7 on D22 ... D29, interlock on D30, LED on D13.
 *
 * Timer4 and not Timer1, whose third output is D13: the bootloader blinks that at every reset. */
#ifndef BOARD_PINS_H
#define BOARD_PINS_H

#define EXACT_OUTPUTS 3
#define EXACT_PORT PORTH
#define EXACT_DDR DDRH
#define EXACT_MASK (1 << 3 | 1 << 4 | 1 << 5) /* PH3 is OC4A, PH4 is OC4B, PH5 is OC4C */

/* The exact outputs' timer. Its bits lie as in every other 16-bit timer. */
#define TIMER_MODE TCCR4A
#define TIMER_SPEED TCCR4B
#define TIMER_FORCE TCCR4C
#define TIMER_COUNT TCNT4
#define TIMER_COUNT_LOW TCNT4L
#define TIMER_COUNT_HIGH TCNT4H
#define TIMER_INTERRUPTS TIMSK4
#define TIMER_FLAGS TIFR4
#define TIMER_MATCH_A OCR4A
#define TIMER_MATCH_A_LOW OCR4AL
#define TIMER_MATCH_B_LOW OCR4BL
#define TIMER_MATCH_C_LOW OCR4CL
#define MATCH_A_vect TIMER4_COMPA_vect
#define MATCH_B_vect TIMER4_COMPB_vect
#define MATCH_C_vect TIMER4_COMPC_vect

#define INTERLOCK_PORT PORTC
#define INTERLOCK_PIN PINC
#define INTERLOCK_MASK (1 << 7)

#define LED_PORT PORTB
#define LED_DDR DDRB
#define LED_MASK (1 << 7)

#ifndef __ASSEMBLER__
static inline void board_select(uint8_t lines) {
    PORTA = lines;
}

static inline void board_select_as_outputs(void) {
    DDRA = 0xFF;
}
#endif

#endif
