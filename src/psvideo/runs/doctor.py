"""The whole of ``psvideo doctor``: what is installed, and what the machine can do."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from psvideo.inspect.findings import Finding, is_well
from psvideo.inspect.machine import machine, strobes
from psvideo.inspect.software import software
from psvideo.inspect.speed import speed


@dataclass(frozen=True, kw_only=True)
class Checkup:
    """All that was found of a machine, one after the other."""

    findings: tuple[Finding, ...]

    @property
    def well(self) -> bool:
        """Whether everything is there that psvideo needs."""
        return is_well(self.findings)


def unshown(finding: Finding) -> None:
    """Show nothing."""


def doctor(folder: Path | str = ".", *, show: Callable[[Finding], None] = unshown) -> Checkup:
    """Look at software, machine, boards and speed; ``folder`` is where the disk is measured.

    Each finding is handed to ``show`` as soon as it is known: measuring takes a second or two.
    """
    findings = []
    for finding in chain(software(), machine(), strobes(), speed(Path(folder))):
        show(finding)
        findings.append(finding)
    return Checkup(findings=tuple(findings))
