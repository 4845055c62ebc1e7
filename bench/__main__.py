"""Print every table: ``python -m bench``, or some of them: ``python -m bench reconstruction kernel``."""

import sys
from importlib import import_module

from bench.table import table

TABLES = (
    "kernel",
    "reconstruction",
    "whole_run",
    "observing",
    "memory",
    "encoding",
    "hostile",
    "hostile_runs",
    "killed",
    "killed_workers",
    "soak",
    "view",
    "live",
    "genlock",
    "timing",
    "compression",
    "strobe",
    "strobe_faults",
    "cameras",
    "instants",
    "colour",
    "rolling",
    "accuracy",
    "predicted",
    "few_lights",
    "metal",
    "verdicts",
    "verdict_rigs",
)

for name in sys.argv[1:] or TABLES:
    module = import_module(f"bench.{name}")
    print(f"\n## {(module.__doc__ or name).splitlines()[0]}\n", flush=True)
    lines = list(module.rows())
    print(table(lines), flush=True)
    if hasattr(module, "summary"):
        print(f"\n{table(module.summary(lines))}", flush=True)
