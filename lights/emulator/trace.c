#include "trace.h"

#include <inttypes.h>
#include <stdio.h>

static FILE *file;

bool trace_open(const char *name, const char *board, uint32_t hz, const char *wiring) {
    if (!name || !*name) return true;
    file = fopen(name, "w");
    if (!file) return false;
    fprintf(file, "# psvideo-trace/1 board=%s hz=%" PRIu32 " wiring=%s\ncycle,line,level\n", board, hz, wiring);
    return true;
}

void trace_edge(uint64_t cycle, char kind, int number, int level) {
    if (!file) return;
    fprintf(file, "%" PRIu64 ",", cycle);
    if (kind) fputc(kind, file);
    fprintf(file, "%d,%d\n", number, level);
}

void trace_flush(void) {
    if (file) fflush(file);
}

bool trace_close(void) {
    if (!file) return true;
    bool whole = !ferror(file);
    whole = fclose(file) == 0 && whole;
    file = NULL;
    return whole;
}
