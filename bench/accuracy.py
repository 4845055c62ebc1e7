"""Normals against the truth: what each fault costs, before and after its remedy, on virtual and on real subjects.

Every subject is a module beside this one, ``bench/accuracy_<subject>.py``, whose ``rows()`` gives ``Accuracy`` rows;
the first line of its description stands over them. All are found by their names.
"""

import pkgutil
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from bench.accuracy_measure import Accuracy

NOT_SUBJECTS = {"accuracy_measure", "accuracy_l1"}


def rows() -> Iterator[Accuracy]:
    """Give every subject's rows under its heading."""
    for name in sorted(module.name for module in pkgutil.iter_modules([str(Path(__file__).parent)])):
        if name.startswith("accuracy_") and name not in NOT_SUBJECTS:
            subject = import_module(f"bench.{name}")
            yield Accuracy(what=f"**{(subject.__doc__ or name).splitlines()[0]}**")
            yield from subject.rows()
