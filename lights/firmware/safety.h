/* What makes it dark without being asked: watchdog, interlock, silence of the host, an edge that came too late. */
#ifndef SAFETY_H
#define SAFETY_H

#include <stdbool.h>
#include <stdint.h>

void safety_boot(void);
void safety_poll(uint64_t now);

/* RESET_...: why the controller last started. */
uint8_t safety_reset_cause(void);

bool safety_is_interlock_open(void);

/* The host has said something that was answered with OK. */
void safety_heard_host(uint64_t now);

extern uint16_t safety_keep_ms;

#endif
