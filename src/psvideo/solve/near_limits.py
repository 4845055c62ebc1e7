"""How often the surface that near lights shine on is made anew; on its own, so that ``--help`` loads no solver."""

NEAR_ITERATIONS = 1
"""How often the surface is made anew unless the user says otherwise: one leaves what the plane's distance costs."""
MOST_ITERATIONS = 10
