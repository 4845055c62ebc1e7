"""The records of ``model`` on disk: plans, rigs, timings, flat fields; and files that appear whole or not at all."""
