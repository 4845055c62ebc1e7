"""Print every table: ``python -m bench``, or some of them: ``python -m bench reconstruction kernel``."""

import sys
from importlib import import_module

from bench.table import table

TABLES = ("kernel", "reconstruction", "whole_run", "timing", "strobe")

for name in sys.argv[1:] or TABLES:
    module = import_module(f"bench.{name}")
    print(f"\n## {module.__doc__.splitlines()[0]}\n", flush=True)
    print(table(module.rows()), flush=True)
