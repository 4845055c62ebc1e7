/* Generated from lights/protocol.toml by lights/make_protocol_table.py; change those. */
#ifndef PROTOCOL_TABLE_H
#define PROTOCOL_TABLE_H

#define PROTOCOL 1
#define LONGEST_REQUEST 96
#define LONGEST_REPLY 250
#define LONGEST_NONCE 8
#define CHECKSUM_POLYNOMIAL 0x1021
#define CHECKSUM_START 0xFFFF

#define ERROR_BYTES 1
#define ERROR_LONG 2
#define ERROR_CRC 3
#define ERROR_COMMAND 4
#define ERROR_WORDS 5
#define ERROR_NUMBER 6
#define ERROR_RANGE 7
#define ERROR_STATE 8
#define ERROR_LIMIT 9
#define ERROR_INCOMPLETE 10
#define ERROR_CHECK 11
#define ERROR_FAULT 12
#define ERROR_INTERLOCK 13
#define ERROR_POWERS 14

#define STATE_IDLE 0
#define STATE_ARMED 1
#define STATE_RUNNING 2
#define STATE_FAULT 3
#define STATE_NAMES "idle armed running fault"

#define FAULT_NONE 0
#define FAULT_SILENT 1
#define FAULT_INTERLOCK 2
#define FAULT_LATE 3
#define FAULT_WATCHDOG 4
#define FAULT_NAMES "none silent interlock late watchdog"

#define RESET_POWER 0
#define RESET_EXTERNAL 1
#define RESET_BROWNOUT 2
#define RESET_WATCHDOG 3
#define RESET_OTHER 4
#define RESET_NAMES "power external brownout watchdog other"

#define WIRING_GATED 0
#define WIRING_DIRECT 1
#define WIRING_NAMES "gated direct"

#define WAY_LATER 0
#define WAY_SOONER 1
#define WAY_NAMES "later sooner"

#define MANY_WORDS 255
/* X(name, fewest words, most words, states in which it is taken, keys of the reply) */
#define COMMANDS(X) \
    X(ID, 0, 0, 1 << STATE_IDLE | 1 << STATE_ARMED | 1 << STATE_RUNNING | 1 << STATE_FAULT, "proto board firmware unit") \
    X(CAPS, 0, 0, 1 << STATE_IDLE | 1 << STATE_ARMED | 1 << STATE_RUNNING | 1 << STATE_FAULT, "tick_ps wiring lines powers slots steps min_on min_off min_dark max_flash max_period max_line_ppm max_total_ppm tolerance_ppm keep_ms") \
    X(WIRING, 1, 1, 1 << STATE_IDLE, "wiring") \
    X(KEEP, 1, 1, 1 << STATE_IDLE | 1 << STATE_ARMED | 1 << STATE_RUNNING, "keep_ms") \
    X(NEW, 0, 0, 1 << STATE_IDLE | 1 << STATE_ARMED, "") \
    X(SLOT, 4, MANY_WORDS, 1 << STATE_IDLE, "slot") \
    X(STEPS, 2, MANY_WORDS, 1 << STATE_IDLE, "steps") \
    X(ARM, 1, 1, 1 << STATE_IDLE, "check cycle") \
    X(RUN, 1, 1, 1 << STATE_ARMED, "start") \
    X(TRIM, 2, 2, 1 << STATE_RUNNING, "way ppm") \
    X(STOP, 0, 0, 1 << STATE_IDLE | 1 << STATE_ARMED | 1 << STATE_RUNNING | 1 << STATE_FAULT, "state cycles") \
    X(STAT, 0, 0, 1 << STATE_IDLE | 1 << STATE_ARMED | 1 << STATE_RUNNING | 1 << STATE_FAULT, "state fault reset interlock cycle step cycles") \
    X(CLK, 1, 1, 1 << STATE_IDLE | 1 << STATE_ARMED | 1 << STATE_RUNNING | 1 << STATE_FAULT, "nonce cycle ticks") \
    X(CLEAR, 0, 0, 1 << STATE_IDLE | 1 << STATE_FAULT, "state")

#define MAX_FLASH_US 50000UL
#define MIN_DARK_US 100UL
#define MAX_LINE_PPM 500000UL
#define MAX_TOTAL_PPM 2000000UL
#define LEAST_KEEP_MS 100
#define MOST_KEEP_MS 2000
#define MAX_CYCLE_S 60UL
#define MAX_TRIM_PPM 20000UL

#ifdef __AVR_ATmega328P__
#define BOARD_NAME "atmega328p"
#define TICK_PS 500000UL
#define LINES_GATED 8
#define LINES_DIRECT 2
#define POWERS_GATED 1
#define POWERS_DIRECT 2
#define SLOTS 16UL
#define STEPS 240UL
#define MIN_ON_US 20UL
#define MIN_OFF_US 20UL
#define TOLERANCE_PPM 5000UL
#define TRIM_LEAD_MS 0UL
#endif
#ifdef __AVR_ATmega2560__
#define BOARD_NAME "atmega2560"
#define TICK_PS 500000UL
#define LINES_GATED 8
#define LINES_DIRECT 3
#define POWERS_GATED 1
#define POWERS_DIRECT 3
#define SLOTS 32UL
#define STEPS 240UL
#define MIN_ON_US 20UL
#define MIN_OFF_US 20UL
#define TOLERANCE_PPM 5000UL
#define TRIM_LEAD_MS 0UL
#endif
#endif
