/* The main loop: everything but the edges is polled here, one small thing after the other. */
#include <avr/interrupt.h>

#include "clock.h"
#include "commands.h"
#include "control.h"
#include "player.h"
#include "reply.h"
#include "safety.h"
#include "uart.h"

static void poll_line(uint64_t now) {
    uint8_t byte;
    bool lost;
    reply_poll();
    if (reply_is_leaving() || !uart_take(&byte, &lost)) return; /* the host waits for the reply */
    line_t *line = line_take(byte, lost);
    if (line) commands_answer(line, now);
}

int main(void) {
    player_boot();
    clock_start();
    uart_start();
    safety_boot();
    sei();
    for (;;) {
        uint64_t now = clock_now();
        safety_poll(now);
        control_poll(now);
        control_show(now);
        poll_line(now);
    }
}
