#ifdef TEST_HANG
#include "hang.h"

#include <avr/interrupt.h>
#include <stdbool.h>
#include <string.h>
#define F_CPU 16000000UL
#include <util/delay.h>

void hang(const char *how) {
    bool deaf = strcmp(how, "deaf") == 0;
    if (strcmp(how, "blind") == 0) TIMSK1 = 0;
    if (deaf || strcmp(how, "late") == 0) cli();
    if (strcmp(how, "late") == 0) _delay_ms(1);
    while (deaf || strcmp(how, "loop") == 0) {
    }
    sei();
}
#else
typedef int nothing_here; /* the Arduino IDE compiles every file of the folder */
#endif
