/* Only in the build for tests: break the firmware on purpose. */
#ifndef HANG_H
#define HANG_H

/* `loop`: the main loop stands still. `deaf`: no more interrupts either. `blind`: the player's interrupts are gone.
 * `late`: no interrupts for 1 ms. */
void hang(const char *how);

#endif
