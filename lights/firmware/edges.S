; The short way to the next edge, in assembly because of its time: with three outputs in bursts of 20 us on and 20 us off
; there is an interrupt every 107 CPU cycles, and C takes that many to save its registers. player.c explains the rest.
#include "board.h"
#include "player_flags.h"

#define ON 0
#define OFF 2
#define LAST 4
#define MORE 6
#define SIZE 8

.macro restore_registers
    pop  r23
    pop  r22
    pop  r25
    pop  r24
    out  _SFR_IO_ADDR(SREG), r24
    pop  r24
.endm

.macro edge vector, long_way, output, rise_bit, compare
    .set short, SHORT_A + 2 * \output
    .set once, ONCE_A + 2 * \output
    .set data, SIZE * \output
.global \vector
\vector:
    sbis _SFR_IO_ADDR(GPIOR0), short
    jmp  \long_way
    push r24
    in   r24, _SFR_IO_ADDR(SREG)
    push r24
    push r25
    push r22
    push r23
    sbic _SFR_IO_ADDR(GPIOR0), once
    cbi  _SFR_IO_ADDR(GPIOR0), short
    lds  r22, TCCR1A
    sbrs r22, \rise_bit
    rjmp 1f
    ; a burst has begun: the next match clears, `on` later
    andi r22, 0xFF - (1 << \rise_bit)
    sts  TCCR1A, r22
    lds  r22, short_way + data + ON
    lds  r23, short_way + data + ON + 1
    rjmp 3f
1:  ; a burst is over: the next match sets, `off` later
    ori  r22, 1 << \rise_bit
    sts  TCCR1A, r22
    lds  r24, short_way + data + MORE
    lds  r25, short_way + data + MORE + 1
    sbiw r24, 1
    sts  short_way + data + MORE, r24
    sts  short_way + data + MORE + 1, r25
    brne 2f
    ; that one will be the last: serve its rise here where its end is near, and leave what follows to the long way
    lds  r24, short_way + data + LAST
    lds  r25, short_way + data + LAST + 1
    sts  short_way + data + ON, r24
    sts  short_way + data + ON + 1, r25
    sbi  _SFR_IO_ADDR(GPIOR0), once
    sbrs r25, 7
    sbi  _SFR_IO_ADDR(GPIOR0), short
2:  lds  r22, short_way + data + OFF
    lds  r23, short_way + data + OFF + 1
3:  lds  r24, \compare
    lds  r25, \compare + 1
    add  r24, r22
    adc  r25, r23
    sts  \compare + 1, r25
    sts  \compare, r24
    lds  r22, TCNT1L
    lds  r23, TCNT1H
    sub  r22, r24
    sbc  r23, r25
    brpl 4f
    restore_registers
    reti
4:  restore_registers
    jmp  __vector_late
.endm

.text
edge TIMER1_COMPA_vect, __vector_long_a, 0, COM1A0, OCR1AL
edge TIMER1_COMPB_vect, __vector_long_b, 1, COM1B0, OCR1BL
#if EXACT_OUTPUTS > 2
edge TIMER1_COMPC_vect, __vector_long_c, 2, COM1C0, OCR1CL
#endif
