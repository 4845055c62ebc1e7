/* Edges of an emulated run as CSV (../protocol.md, "Pins"): virtual time only, never the wall clock. */
#ifndef TRACE_H
#define TRACE_H

#include <stdbool.h>
#include <stdint.h>

/* Open FILE for the trace and write its first line; "" or NULL = no trace. False where the file cannot be written. */
bool trace_open(const char *file, const char *board, uint32_t hz, const char *wiring);

/* Note that a pin ("X0", "S3") or a light ("0") changed to level at a CPU cycle. */
void trace_edge(uint64_t cycle, char kind, int number, int level);

/* Write out what is buffered, so that whoever reads the trace meanwhile finds every edge until now. */
void trace_flush(void);

/* Write out what is buffered and close. False where something could not be written. */
bool trace_close(void);

#endif
