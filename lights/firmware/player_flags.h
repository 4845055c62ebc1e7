/* Two flags in GPIOR0 for every output, two bits further on for each. Also read by edges.S. */
#ifndef PLAYER_FLAGS_H
#define PLAYER_FLAGS_H

#define SHORT_A 0 /* edges.S serves the next match */
#define ONCE_A 1  /* and only that one */
#define FLAG_SHORT_A (1 << SHORT_A)
#define FLAG_ONCE_A (1 << ONCE_A)

#endif
