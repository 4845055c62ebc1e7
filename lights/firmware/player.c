/* Every exact output has one compare unit of the timer, and walks through the cycle by itself.
 *
 * An event is a compare match that has just set, cleared or kept the pin. Its interrupt adds whole ticks to that compare
 * register, so that nothing accumulates, and says what the next match does. Two ways lead there. The short way
 * (edges.S, about 70 cycles) serves edges behind which the next one is near; it needs `short_way` and two flags of
 * GPIOR0. The long way (here) serves all others: waits of more than 16 bits, and the steps of the cycle. It lets other
 * interrupts in, because its own next match is at least 100 us away, and prepares the short way for the edge it arms.
 */
#include "player.h"

#include <avr/cpufunc.h>
#include <avr/interrupt.h>
#include <util/atomic.h>

#include "board.h"
#include "player_flags.h"
#include "program.h"

#define SEGMENT 0x8000 /* long waits are cut into such pieces, the first one and a bit */
#define NEAR 0x7FFFUL  /* the longest wait that edges.S arms by itself */
#define OCR(output) ((volatile uint16_t *)&TIMER_MATCH_A)[output]
#define RISE_BIT(output) (uint8_t)(1 << COM1A0 >> 2 * (output))   /* with it a match sets the pin, without it clears */
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
    const part_t *part; /* of the flash that comes or goes on */
    uint32_t cycles;    /* that are still to begin behind this one */
    uint16_t waits;     /* whole segments that are left of a long wait */
    uint8_t step;
    uint8_t settled; /* the low byte of how many steps it asked the length of */
    bool counts, rises; /* are cycles counted; does the edge that it waits for rise */
    volatile bool done, served;
} output_t;

static output_t outputs[EXACT_OUTPUTS];
static trim_t trim;
static bool trims;                /* was this run trimmed at all? */
static volatile uint8_t settled;  /* the low byte of how many steps have their length */
static volatile bool wanted;      /* is there a trim to be taken over? Then interrupts read what follows: */
static volatile uint32_t wanted_from;
static share_t wanted_share;
static int32_t extra, next_extra; /* ticks of the step settled last, and of the one behind it */
static volatile bool late;
static bool gated;

static void select(uint8_t lines) {
    if (gated) board_select(lines);
}

void player_stop(void) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        TIMER_INTERRUPTS = 0;
        TIMER_MODE = 0;                  /* the compare units let go of the pins: */
        EXACT_PORT &= ~EXACT_MASK;   /* low */
        board_select(0);
        GPIOR0 = 0;
        /* A unit that was stopped in a flash still remembers high. Let it forget that with the pins as inputs. */
        EXACT_DDR &= ~EXACT_MASK;
        for (uint8_t output = 0; output < EXACT_OUTPUTS; output++) TIMER_MODE |= MATCH_BITS(output);
        TIMER_FORCE = 0xE0; /* force a match, which clears */
        TIMER_MODE = 0;
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
    for (uint8_t n = 0; n < EXACT_OUTPUTS; n++) {
        if (!outputs[n].done && !outputs[n].served) return false;
    }
    for (uint8_t n = 0; n < EXACT_OUTPUTS; n++) outputs[n].served = false;
    return true;
}

ISR(__vector_late) {
    late = true;
    player_stop();
}

/* What follows is compiled once for every output, with its number known: a third of the time. */
#define PER_OUTPUT static inline __attribute__((always_inline))

/* The flags for the edge that is being armed: may edges.S serve it, and only it? */
PER_OUTPUT uint8_t flags_of(uint8_t n) {
    const part_t *part = outputs[n].part;
    uint16_t more = short_way[n].more;
    uint32_t on = more ? part->on : part->last;
    if (!part->bursts) return 0;
    if (!outputs[n].rises) return more && part->off <= NEAR ? SHORT_FLAG(n) | ONCE_FLAG(n) : 0;
    if (on > NEAR) return 0;
    short_way[n].on = on;
    return more && part->off <= NEAR ? SHORT_FLAG(n) : SHORT_FLAG(n) | ONCE_FLAG(n);
}

/* Arm the next match of an output. Until the last piece of a wait, it does to the pin what was done already. */
PER_OUTPUT void arm(uint8_t n, uint16_t ticks) {
    output_t *output = &outputs[n];
    bool last = !output->waits;
    uint8_t flags = last ? flags_of(n) : 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (late) return; /* another output was, meanwhile: stay dark */
        uint16_t now = OCR(n);
        OCR(n) = now + ticks;
        GPIOR0 = (GPIOR0 & ~(SHORT_FLAG(n) | ONCE_FLAG(n))) | flags;
        if (last) TIMER_MODE = output->rises ? TIMER_MODE | RISE_BIT(n) : TIMER_MODE & ~RISE_BIT(n);
        if (TIMER_COUNT - now >= ticks) {
            late = true;
            player_stop();
        }
    }
}

/* Cut a wait into pieces. Returns the first, which is the longest. */
PER_OUTPUT uint16_t cut(output_t *output, uint32_t ticks) {
    uint16_t piece = ticks;
    output->waits = (uint16_t)(ticks >> 16) << 1; /* whole segments; a shift by 15 in one piece takes ten times as long */
    if (!output->waits) return piece;
    if (!(piece & SEGMENT)) output->waits--;
    return piece | SEGMENT;
}

/* Read what an output does in the step that comes. */
PER_OUTPUT void load(uint8_t n) {
    const slot_t *slot = &program_slots[program_steps[outputs[n].step]];
    const part_t *part = &slot->part[n];
    outputs[n].part = part;
    outputs[n].rises = part->bursts;
    short_way[n].more = part->bursts - 1;
    short_way[n].off = part->off;
    short_way[n].last = part->last > NEAR ? 0xFFFF : part->last;
    if (n == 0) select(slot->lit);
}

/* Work out by how much the step is longer that comes behind the one just settled. */
static void settle_next(void) {
    if (wanted) {
        if (!trims) trim.step = wanted_from - (uint8_t)((uint8_t)wanted_from - settled);
        trims = true;
        trim_set(&trim, wanted_share, wanted_from);
        wanted = false;
    }
    if (!trims) return;
    next_extra = trim_extra(&trim);
    trim_pass(&trim);
}

/* By how much the step is longer that is played. The output that asks first settles it for all: all others ask before
 * the step is over, and so before any asks for the next. Interrupts wait for a few instructions only. */
PER_OUTPUT int32_t extra_of_step(output_t *output) {
    uint8_t step = output->settled++;
    bool first = false;
    int32_t ticks;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (step == settled) {
            first = true;
            settled++;
            extra = next_extra;
        }
        ticks = extra;
    }
    if (first && (trims || wanted)) settle_next();
    return ticks;
}

bool player_is_beyond(uint32_t step) {
    return (int8_t)(settled - (uint8_t)step) > 1;
}

void player_trim(share_t share, uint32_t from) {
    wanted_share = share;
    wanted_from = from;
    _MemoryBarrier(); /* an interrupt that sees `wanted` finds the rest in its place */
    wanted = true;
}

PER_OUTPUT void finish(uint8_t n) {
    outputs[n].done = true;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        TIMER_INTERRUPTS &= ~INTERRUPT_BIT(n);
    }
    if (n == 0) select(0);
}

/* Go on to the next step. Returns false where the last cycle is over. */
PER_OUTPUT bool next_step(output_t *output) {
    if (++output->step < program_step_count) return true;
    output->step = 0;
    return !output->counts || output->cycles--;
}

PER_OUTPUT void serve(uint8_t n) {
    output_t *output = &outputs[n];
    uint32_t ticks;
    output->served = true;
    if (output->waits) {
        output->waits--;
        arm(n, SEGMENT);
        return;
    }
    if (output->part->bursts && TIMER_MODE & RISE_BIT(n)) { /* a burst has begun */
        ticks = short_way[n].more ? output->part->on : output->part->last;
        output->rises = false;
    } else if (output->part->bursts && short_way[n].more) { /* one of several is over */
        ticks = output->part->off;
        short_way[n].more--;
        output->rises = true;
    } else {
        ticks = output->part->rest + extra_of_step(output);
        if (!next_step(output)) {
            finish(n);
            return;
        }
        load(n);
    }
    arm(n, cut(output, ticks));
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

PER_OUTPUT void start_output(uint8_t n, uint16_t from, uint32_t ticks, uint32_t cycles) {
    output_t *output = &outputs[n];
    output->step = 0;
    output->settled = 0;
    output->counts = cycles;
    output->cycles = cycles - 1;
    output->done = false;
    output->served = true;
    load(n);
    OCR(n) = from - 1; /* a pin changes one tick after its match */
    TIMER_MODE |= MATCH_BITS(n);
    TIMER_FLAGS = INTERRUPT_BIT(n);
    arm(n, cut(output, ticks));
    TIMER_INTERRUPTS |= INTERRUPT_BIT(n);
}

void player_start(uint64_t from, uint32_t ticks, uint32_t cycles) {
    gated = program_wiring == WIRING_GATED;
    late = false;
    trims = wanted = false;
    settled = 0;
    extra = next_extra = 0;
    trim_start(&trim, program_parts());
    for (uint8_t n = 0; n < EXACT_OUTPUTS; n++) outputs[n].done = true;
    start_output(0, from, ticks, cycles);
    if (gated) return;
    start_output(1, from, ticks, cycles);
#if EXACT_OUTPUTS > 2
    start_output(2, from, ticks, cycles);
#endif
}
