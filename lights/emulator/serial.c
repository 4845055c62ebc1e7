#include "serial.h"

#include <simavr/avr_uart.h>
#include <simavr/sim_io.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

DEFINE_FIFO(uint16_t, uart_fifo);

#define QUEUE 4096
#define RECEIVER_HOLDS 3 /* two bytes and the shift register */
#define NEVER UINT64_MAX

static avr_t *avr;
static avr_uart_t *uart;
static byte_sink on_sent;
static uint8_t queue[QUEUE];
static size_t first, count;
static uint64_t arrives = NEVER, line_free;
static unsigned long lost;
static int overrun;

static void sent(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq;
    (void)param;
    on_sent((uint8_t)value);
}

static avr_uart_t *find_uart(char name) {
    for (avr_io_t *io = avr->io_port; io; io = io->next)
        if (!strcmp(io->kind, "uart") && ((avr_uart_t *)io)->name == name) return (avr_uart_t *)io;
    fprintf(stderr, "emulator: this libsimavr has no UART %c.\n", name);
    exit(1);
}

void serial_open(avr_t *chip, byte_sink sink) {
    avr = chip;
    uart = find_uart('0');
    on_sent = sink;
    uint32_t flags = 0; /* no echo, no sleeping: virtual time only */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(uart->io.irq + UART_IRQ_OUTPUT, sent, NULL);
}

void serial_after_reset(void) { overrun = 0; }

static uint64_t byte_cycles(void) { return uart->cycles_per_byte > 100 ? uart->cycles_per_byte : CPU_HZ / 11520; }

size_t board_receive(const uint8_t *bytes, size_t many) {
    size_t taken = 0;
    for (; taken < many && count < QUEUE; taken++, count++) queue[(first + count) % QUEUE] = bytes[taken];
    if (taken && arrives == NEVER) {
        uint64_t begins = avr->cycle > line_free ? avr->cycle : line_free;
        arrives = begins + byte_cycles();
    }
    return taken;
}

bool board_listens(void) { return avr_regbit_get(avr, uart->rxen); }

size_t board_on_their_way(void) { return count; }

unsigned long board_lost_bytes(void) { return lost; }

static void arrive(uint8_t byte) {
    if (!avr_regbit_get(avr, uart->rxen)) return;
    if (uart_fifo_get_read_size(&uart->input) >= RECEIVER_HOLDS) {
        lost++;
        overrun = 1;
        avr_regbit_set(avr, uart->dor);
        return;
    }
    uart_fifo_write(&uart->input, byte);
    uart->rxc_raise_time = 0; /* the library's own brake on reading is not needed: bytes come no faster than the line */
    avr_raise_interrupt(avr, &uart->rxc);
}

void serial_step(void) {
    if (overrun && uart_fifo_isempty(&uart->input)) {
        overrun = 0;
        avr_regbit_clear(avr, uart->dor);
    }
    if (avr->cycle < arrives) return;
    line_free = arrives;
    uint8_t byte = queue[first];
    first = (first + 1) % QUEUE;
    count--;
    arrives = count ? line_free + byte_cycles() : NEVER;
    arrive(byte);
}
