/* Every exact output has one compare unit of Timer1, and walks through the cycle by itself.
 *
 * An event is a compare match that has just set, cleared or kept the pin. Its interrupt adds whole ticks to that compare
 * register, so that nothing accumulates, and says what the next match does. Two ways lead there. The short way
 * (edges.S, about 70 cycles) serves edges behind which the next one is near; it needs `short_way` and two flags of
 * GPIOR0. The long way (here) serves all others: waits of more than 16 bits, and the steps of the cycle. It lets other
 * interrupts in, because its own next match is at least 100 us away, and prepares the short way for the edge it arms.
 */
#include "player.h"

#include <avr/interrupt.h>
#include <util/atomic.h>

#include "board.h"
#include "player_flags.h"
#include "program.h"

#define SEGMENT 0x4000  /* long waits are cut into such pieces, the first one and a bit */
#define NEAR 0x7FFFUL   /* the longest wait that edges.S arms by itself */
#define OCR(output) ((volatile uint16_t *)&OCR1A)[output]
#define RISE_BIT(output) (uint8_t)(1 << COM1A0 >> 2 * (output)) /* with it a match sets the pin, without it clears */
#define MATCH_BITS(output) (uint8_t)(1 << COM1A1 >> 2 * (output)) /* the unit drives the pin */
#define INTERRUPT_BIT(output) (uint8_t)(1 << OCIE1A << (output))
#define SHORT_FLAG(output) (uint8_t)(FLAG_SHORT_A << 2 * (output))
#define ONCE_FLAG(output) (uint8_t)(FLAG_ONCE_A << 2 * (output))

/* edges.S knows this layout. */
volatile struct {
    uint16_t on, off, last; /* `last` is the last burst's on; 0xFFFF where that is far */
    uint16_t more;          /* bursts that begin behind the one that goes on or comes */
} short_way[EXACT_OUTPUTS];

typedef struct {
    uint32_t on, off, last; /* of the flash that comes or goes on */
    uint32_t rest;          /* from its last fall, or its start where this output is dark in it, to the next step */
    uint32_t cycles;        /* that are still to begin behind this one; 0 where it goes on until told */
    uint16_t waits;         /* whole segments that are left of a long wait */
    uint8_t step;
    bool lit, rises, counts; /* is it lit in this step; does the edge that it waits for rise; are cycles counted */
    volatile bool done, served;
} output_t;

static output_t outputs[EXACT_OUTPUTS];
static volatile bool late;
static bool gated;

static void select(uint8_t lines) {
    if (gated) board_select(lines);
}

void player_stop(void) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        TIMSK1 = 0;
        TCCR1A = 0;                  /* the compare units let go of the pins: */
        EXACT_PORT &= ~EXACT_MASK;   /* low */
        board_select(0);
        GPIOR0 = 0;
        /* A unit that was stopped in a flash still remembers high. Let it forget that with the pins as inputs. */
        EXACT_DDR &= ~EXACT_MASK;
        for (uint8_t output = 0; output < EXACT_OUTPUTS; output++) TCCR1A |= MATCH_BITS(output);
        TCCR1C = 0xE0; /* force a match, which clears */
        TCCR1A = 0;
        EXACT_DDR |= EXACT_MASK;
    }
}

void player_boot(void) {
    EXACT_PORT &= ~EXACT_MASK;
    board_select(0);
    board_select_as_outputs();
    player_stop();
}

bool player_was_late(void) {
    return late;
}

bool player_is_alive(void) {
    bool alive = true;
    for (uint8_t output = 0; output < EXACT_OUTPUTS; output++) {
        if (!outputs[output].done && !outputs[output].served) alive = false;
        outputs[output].served = false;
    }
    return alive;
}

ISR(__vector_late) {
    late = true;
    player_stop();
}

/* The flags for the edge that is being armed: may edges.S serve it, and only it? */
static uint8_t flags_of(uint8_t n) {
    output_t *output = &outputs[n];
    uint16_t more = short_way[n].more;
    if (!output->lit) return 0;
    uint32_t on = more ? output->on : output->last;
    if (output->rises) {
        if (on > NEAR) return 0;
        short_way[n].on = on;
        return SHORT_FLAG(n) | (more && output->off <= NEAR ? 0 : ONCE_FLAG(n));
    }
    return more && output->off <= NEAR ? SHORT_FLAG(n) | ONCE_FLAG(n) : 0;
}

/* Arm the next match of an output. Until the last piece of a wait, it does to the pin what was done already. */
static void arm(uint8_t n, uint16_t ticks) {
    output_t *output = &outputs[n];
    uint8_t flags = output->waits ? 0 : flags_of(n);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (late) return; /* another output was, meanwhile: stay dark */
        uint16_t target = OCR(n) + ticks;
        OCR(n) = target;
        GPIOR0 = (GPIOR0 & ~(SHORT_FLAG(n) | ONCE_FLAG(n))) | flags;
        if (!output->waits) TCCR1A = output->rises ? TCCR1A | RISE_BIT(n) : TCCR1A & ~RISE_BIT(n);
        if ((int16_t)(TCNT1 - target) >= 0) {
            late = true;
            player_stop();
        }
    }
}

static void wait(uint8_t n, uint32_t ticks, bool rises) {
    outputs[n].rises = rises;
    outputs[n].waits = ticks / SEGMENT;
    ticks %= SEGMENT;
    if (outputs[n].waits) {
        outputs[n].waits--;
        ticks += SEGMENT;
    }
    arm(n, ticks);
}

/* Read what an output does in the step that comes. */
static void load(uint8_t n) {
    output_t *output = &outputs[n];
    const slot_t *slot = &program_slots[program_steps[output->step]];
    uint32_t on = slot->on[n];
    bool full = on == slot->period;
    uint32_t room = full ? slot->duration : slot->last_room;
    output->lit = on;
    output->on = on;
    output->off = slot->period - on;
    output->last = full || on > room ? room : on;
    output->rest = slot->dark + (on ? room - output->last : slot->duration);
    short_way[n].more = full ? 0 : slot->bursts - 1;
    short_way[n].off = output->off;
    short_way[n].last = output->last > NEAR ? 0xFFFF : output->last;
    if (n == 0) select(slot->lit);
}

static void finish(uint8_t n) {
    outputs[n].done = true;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        TIMSK1 &= ~INTERRUPT_BIT(n);
    }
    if (n == 0) select(0);
}

static void next_step(uint8_t n) {
    output_t *output = &outputs[n];
    uint32_t ticks = output->rest;
    if (++output->step == program_step_count) {
        output->step = 0;
        if (output->counts && !output->cycles--) {
            finish(n);
            return;
        }
    }
    load(n);
    wait(n, ticks, output->lit);
}

static void serve(uint8_t n) {
    output_t *output = &outputs[n];
    output->served = true;
    if (output->waits) {
        output->waits--;
        arm(n, SEGMENT);
    } else if (!output->lit) {
        next_step(n);
    } else if (TCCR1A & RISE_BIT(n)) { /* a burst has begun */
        wait(n, short_way[n].more ? output->on : output->last, false);
    } else if (short_way[n].more) {
        short_way[n].more--;
        wait(n, output->off, true);
    } else {
        next_step(n);
    }
}

ISR(__vector_long_a, ISR_NOBLOCK) {
    serve(0);
}

ISR(__vector_long_b, ISR_NOBLOCK) {
    serve(1);
}

#if EXACT_OUTPUTS > 2
ISR(__vector_long_c, ISR_NOBLOCK) {
    serve(2);
}
#endif

static void start_output(uint8_t n, uint16_t from, uint32_t ticks, uint32_t cycles) {
    output_t *output = &outputs[n];
    output->step = 0;
    output->counts = cycles;
    output->cycles = cycles - 1;
    output->done = false;
    output->served = true;
    load(n);
    OCR(n) = from - 1; /* a pin changes one tick after its match */
    TCCR1A |= MATCH_BITS(n);
    TIFR1 = INTERRUPT_BIT(n);
    wait(n, ticks, output->lit);
    TIMSK1 |= INTERRUPT_BIT(n);
}

void player_start(uint64_t from, uint32_t ticks, uint32_t cycles) {
    gated = program_wiring == WIRING_GATED;
    late = false;
    for (uint8_t n = 0; n < EXACT_OUTPUTS; n++) {
        outputs[n].done = true;
        if (n == 0 || !gated) start_output(n, from, ticks, cycles);
    }
}
