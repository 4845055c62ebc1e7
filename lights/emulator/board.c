#include "board.h"

#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <stdio.h>
#include <string.h>

#include "match.h"
#include "serial.h"
#include "trace.h"

static const layout LAYOUTS[] = {
    {
        .mcu = "atmega328p",
        .exact_count = 2,
        .exact = {{'B', 1}, {'B', 2}},
        .selection = {{'D', 2}, {'D', 3}, {'D', 4}, {'D', 5}, {'D', 6}, {'D', 7}, {'C', 0}, {'C', 1}},
        .interlock = {'C', 2},
        .ports = 0x24, /* DDRB to PORTD */
        .mcusr = 0x54,
    },
    {
        .mcu = "atmega2560",
        .exact_count = 3,
        .exact = {{'B', 5}, {'B', 6}, {'B', 7}},
        .selection = {{'A', 0}, {'A', 1}, {'A', 2}, {'A', 3}, {'A', 4}, {'A', 5}, {'A', 6}, {'A', 7}},
        .interlock = {'C', 7},
        .ports = 0x20, /* PINA to DDRC */
        .mcusr = 0x54,
    },
};

/* PINA is at 0x20 on both chips, then DDRA, PORTA, PINB, ... */
#define PIN_OF(port) (0x20 + 3 * ((port) - 'A'))
#define DDR_OF(port) (PIN_OF(port) + 1)
#define PORT_OF(port) (PIN_OF(port) + 2)
#define PORF 0x01
#define EXTRF 0x02
#define BORF 0x04
#define WDRF 0x08

static avr_t *avr;
static const layout *at;
static bool is_gated;
static reset_sink on_reset;
static bool interlock_open;
static bool was_reset;
static void (*chip_reset)(avr_t *);
static uint64_t seen_ports;
static uint32_t exact_levels, selection_levels, line_levels; /* a bit each */

static void quiet(struct avr_t *chip, const int level, const char *format, va_list words) {
    (void)chip;
    if (level <= LOG_ERROR && level != LOG_OUTPUT) vfprintf(stderr, format, words);
}

static void do_not_sleep(avr_t *chip, avr_cycle_count_t how_long) {
    (void)chip;
    (void)how_long; /* virtual time passes by itself; whoever calls board_step() keeps pace with the wall */
}

static int drives(pin where) {
    return (avr->data[DDR_OF(where.port)] & avr->data[PORT_OF(where.port)]) >> where.bit & 1;
}

static int exact_level(int n) {
    if (!(avr->data[DDR_OF(at->exact[n].port)] >> at->exact[n].bit & 1)) return 0; /* floats: the pull-down holds it */
    return match_connected(n) ? match_latch(n) : drives(at->exact[n]);
}

static void note(uint64_t cycle, char kind, uint32_t *levels, uint32_t now, int count) {
    for (int n = 0; n < count; n++)
        if ((*levels ^ now) >> n & 1) trace_edge(cycle, kind, n, now >> n & 1);
    *levels = now;
}

/* See what the pins do now and what the lights make of it; write every change to the trace. */
static void look_at_pins(uint64_t cycle) {
    uint32_t exact = 0, selection = 0;
    for (int n = 0; n < at->exact_count; n++) exact |= (uint32_t)exact_level(n) << n;
    for (int n = 0; n < LINES; n++) selection |= (uint32_t)drives(at->selection[n]) << n;
    uint32_t lines = is_gated ? (exact & 1 ? selection : 0) : exact;
    note(cycle, 'X', &exact_levels, exact, at->exact_count);
    note(cycle, 'S', &selection_levels, selection, LINES);
    note(cycle, 0, &line_levels, lines, LINES);
}

static void chip_is_reset(avr_t *chip) {
    if (chip_reset) chip_reset(chip);
    was_reset = true;
}

/* The level stands in PIN, and as the outside's pull in the port, which writes PIN whenever PORT or DDR change. */
static void set_interlock(void) {
    uint8_t mask = 1 << at->interlock.bit;
    avr_ioport_external_t pull = {.name = at->interlock.port, .mask = mask, .value = interlock_open ? mask : 0};
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(at->interlock.port), &pull);
    avr_irq_t *irq = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(at->interlock.port), at->interlock.bit);
    avr_raise_irq(irq, interlock_open);
    uint8_t *pins = &avr->data[PIN_OF(at->interlock.port)];
    *pins = interlock_open ? *pins | mask : *pins & ~mask;
}

/* Every reset puts all of the chip's modules back; tie them to the board again. */
static void after_reset(void) {
    was_reset = false;
    match_after_reset();
    serial_after_reset();
    set_interlock();
    look_at_pins(avr->cycle);
}

static const layout *find_layout(const char *mcu) {
    for (size_t n = 0; n < sizeof LAYOUTS / sizeof *LAYOUTS; n++)
        if (!strcmp(LAYOUTS[n].mcu, mcu)) return &LAYOUTS[n];
    fprintf(stderr, "emulator: there is no board %s; known are atmega328p and atmega2560.\n", mcu);
    return NULL;
}

bool board_open(const char *mcu, const char *elf, bool gated, byte_sink sent, reset_sink reset) {
    avr_global_logger_set(quiet);
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    at = find_layout(mcu);
    if (!at) return false;
    if (elf_read_firmware(elf, &firmware) != 0) {
        fprintf(stderr, "emulator: %s cannot be read as firmware (an ELF file that make -C lights/firmware builds).\n",
                elf);
        return false;
    }
    avr = avr_make_mcu_by_name(mcu);
    if (!avr) {
        fprintf(stderr, "emulator: this libsimavr does not know the %s.\n", mcu);
        return false;
    }
    avr_init(avr);
    avr->frequency = CPU_HZ;
    firmware.frequency = CPU_HZ;
    avr_load_firmware(avr, &firmware);
    avr->sleep = do_not_sleep;
    chip_reset = avr->reset;
    avr->reset = chip_is_reset;
    is_gated = gated;
    on_reset = reset;
    match_open(avr, at->exact_count, look_at_pins);
    /* The library would look in every cycle whether INT0 and INT1 (S0 and S1 of the ATmega328P) are low: nobody asks,
     * and it takes three quarters of all time. */
    for (uint8_t number = 0; number < 2; number++) avr_extint_set_strict_lvl_trig(avr, number, 0);
    serial_open(avr, sent);
    after_reset();
    avr->data[at->mcusr] = PORF;
    return true;
}

static const char *reset_cause(void) {
    uint8_t flags = avr->data[at->mcusr];
    return flags & WDRF ? "watchdog" : flags & EXTRF ? "external" : flags & BORF ? "brownout" : "power";
}

bool board_step(void) {
    int state = avr_run(avr);
    if (state == cpu_Done || state == cpu_Crashed) return false;
    if (was_reset) {
        after_reset();
        on_reset(reset_cause());
    }
    serial_step();
    uint64_t ports;
    memcpy(&ports, &avr->data[at->ports], sizeof ports);
    if (ports != seen_ports || match_connection_changed()) {
        seen_ports = ports;
        look_at_pins(avr->cycle);
    }
    return true;
}

uint64_t board_cycle(void) { return avr->cycle; }

void board_interlock(bool open) {
    interlock_open = open;
    set_interlock();
}

void board_hang(void) {
    uint32_t end = avr->flashend - 1;
    avr->flash[end] = 0xff; /* rjmp .-2 */
    avr->flash[end + 1] = 0xcf;
    avr->codeend = avr->flashend;
    avr->sreg[S_I] = 0;
    avr->pc = end;
}

void board_power_off(void) {
    note(avr->cycle, 'X', &exact_levels, 0, at->exact_count);
    note(avr->cycle, 'S', &selection_levels, 0, LINES);
    note(avr->cycle, 0, &line_levels, 0, LINES);
}

void board_reset(void) {
    avr_reset(avr);
    after_reset();
    avr->data[at->mcusr] = EXTRF;
    on_reset("external");
}
