#include "match.h"

#include <simavr/avr_ioport.h>
#include <simavr/avr_timer.h>
#include <simavr/sim_io.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TCCR1A 0x80
#define TCCR1C 0x82
#define LONGEST_INSTRUCTION 32 /* cycles; with an interrupt's entry */

enum { DISCONNECTED, TOGGLE, CLEAR, SET };

static avr_t *avr;
static avr_timer_t *timer;
static pins_changed on_change;
static int output_count;
static int latch[AVR_TIMER_COMP_COUNT];
static uint8_t seen_modes;

static int mode_of(int n) { return avr->data[TCCR1A] >> (6 - 2 * n) & 3; }

bool match_connected(int n) { return mode_of(n) != DISCONNECTED; }

int match_latch(int n) { return latch[n]; }

bool match_connection_changed(void) {
    if (avr->data[TCCR1A] == seen_modes) return false;
    seen_modes = avr->data[TCCR1A];
    return true;
}

static void compare(int n, uint64_t cycle) {
    int mode = mode_of(n);
    if (mode == DISCONNECTED) return;
    int before = latch[n];
    latch[n] = mode == TOGGLE ? !before : mode == SET;
    if (latch[n] != before) on_change(cycle);
}

/* The cycle in which the counter matched, or 0: the chip library also raises the output where the timer wraps or a
 * compare value is written. It reports a match at the end of the instruction that ran meanwhile. */
static uint64_t match_cycle(int n) {
    uint64_t base = timer->tov_base, match = base + timer->comp[n].comp_cycles;
    if (timer->comp[n].comp_cycles == timer->tov_cycles && avr->cycle < match) match = base; /* found with the wrap */
    return avr->cycle >= match && avr->cycle - match <= LONGEST_INSTRUCTION ? match : 0;
}

static void matched(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq;
    (void)value;
    int n = (int)(intptr_t)param;
    uint64_t cycle = match_cycle(n);
    if (cycle) compare(n, cycle);
}

static void force(avr_t *chip, avr_io_addr_t address, uint8_t value, void *param) {
    (void)param;
    avr_core_watch_write(chip, address, value & 0x1f); /* the strobes read as 0 */
    for (int n = 0; n < output_count; n++)
        if (value >> (7 - n) & 1) compare(n, chip->cycle);
}

static avr_timer_t *find_timer(char name) {
    for (avr_io_t *io = avr->io_port; io; io = io->next)
        if (!strcmp(io->kind, "timer") && ((avr_timer_t *)io)->name == name) return (avr_timer_t *)io;
    fprintf(stderr, "emulator: this libsimavr has no timer %c.\n", name);
    exit(1);
}

void match_open(avr_t *chip, int outputs, pins_changed changed) {
    avr = chip;
    timer = find_timer('1');
    output_count = outputs;
    on_change = changed;
    avr_register_io_write(avr, TCCR1C, force, NULL);
    for (int n = 0; n < outputs; n++)
        avr_irq_register_notify(timer->io.irq + TIMER_IRQ_OUT_COMP + n, matched, (void *)(intptr_t)n);
}

/* The chip library ties the comparators to PORT at every reset; the silicon's latch is apart from it. */
void match_after_reset(void) {
    for (int n = 0; n < output_count; n++) {
        avr_ioport_getirq_t request = {.bit = timer->comp[n].com_pin};
        if (avr_ioctl(avr, AVR_IOCTL_IOPORT_GETIRQ_REGBIT, &request) > 0)
            avr_unconnect_irq(timer->io.irq + TIMER_IRQ_OUT_COMP + n, request.irq[0]);
        latch[n] = 0;
    }
}
