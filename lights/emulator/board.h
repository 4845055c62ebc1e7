/* A strobe controller: an emulated AVR with its pins, its serial line and its interlock.
 *
 * The chip is libsimavr's. What its release 1.6 does otherwise than the silicon is put right here (board.c, match.c):
 * - an output-compare pin follows its own latch while the timer is connected to it, whatever PORT says, and PORT is
 *   never changed by the timer; force-compare strobes work;
 * - an edge made by the timer is stamped with the cycle in which the timer made it, not with the end of the
 *   instruction that ran meanwhile;
 * - the receiver holds three bytes (two and the shift register) and then loses bytes and says so.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define EXACT_PINS 3
#define LINES 8
#define CPU_HZ 16000000u

typedef struct {
    char port;
    uint8_t bit;
} pin;

/* Where a board's pins are (../protocol.md, "Pins"); data addresses of the AVR. */
typedef struct {
    const char *mcu;
    int exact_count;
    pin exact[EXACT_PINS];
    pin selection[LINES];
    pin interlock;
    uint16_t ports;      /* the first of eight addresses that hold every PORT and DDR of the pins above */
    uint16_t mcusr;
} layout;

/* Called for every byte that the board sends. */
typedef void (*byte_sink)(uint8_t byte);
/* Called after every reset but the first with its cause. */
typedef void (*reset_sink)(const char *cause);

/* Make the board and load the firmware. False (with a message on stderr) where either cannot be done. */
bool board_open(const char *mcu, const char *elf, bool gated, byte_sink sent, reset_sink reset);

/* Run one instruction. False where the chip stopped for good (sleep without interrupts, a wild jump). */
bool board_step(void);

uint64_t board_cycle(void);

/* True where the firmware has switched its receiver on. */
bool board_listens(void);
/* Queue bytes for the board's receiver; they arrive at the line's speed. Returns how many were taken. */
size_t board_receive(const uint8_t *bytes, size_t count);
/* How many queued bytes are still on their way. */
size_t board_on_their_way(void);
/* How many bytes the receiver lost because the firmware did not read in time. */
unsigned long board_lost_bytes(void);

void board_interlock(bool open);
/* Let the program hang, so that the watchdog bites. */
void board_hang(void);
/* Take the power away: everything goes dark, for the trace's sake. */
void board_power_off(void);
/* Pull the reset pin. */
void board_reset(void);

#endif
