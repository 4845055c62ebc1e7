"""One report over the calibrations of several takes, the worst first: report.json for machines, report.html."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from urllib.parse import quote

from psvideo import __version__
from psvideo.model.rig import Vector
from psvideo.model.units import counted
from psvideo.report.overview import TakeLine, overview_page, take_section

SCHEMA = "psvideo-rigs/1"


@dataclass(frozen=True, kw_only=True)
class LightOfTake:
    """One light as a take shows it: its ``direction`` (unit vector) with its standard error in degrees, its
    ``intensity`` (mean of the channels) with its relative standard error, None where not measured; or it is
    ``missing`` from the rig."""

    name: str
    direction: Vector | None = None
    error_deg: float | None = None
    intensity: float | None = None
    intensity_error: float | None = None
    missing: bool = False


@dataclass(frozen=True, kw_only=True)
class RigResult:
    """What became of one take's calibration: a ``fault``, in a sentence, or its ``lights``; and what to distrust, in
    ``findings``. ``take`` is what was measured, ``rig`` the file that was written."""

    take: Path
    rig: Path
    fault: str = ""
    lights: tuple[LightOfTake, ...] = ()
    findings: tuple[str, ...] = ()

    @property
    def missing(self) -> tuple[str, ...]:
        """Names of the lights that are not in the rig."""
        return tuple(light.name for light in self.lights if light.missing)

    @property
    def usable(self) -> bool:
        """Whether every light is in the rig."""
        return not self.fault and not self.missing

    @property
    def error_deg(self) -> float | None:
        """The largest standard error of a direction, None where no light has one."""
        return max((light.error_deg for light in self.lights if light.error_deg is not None), default=None)

    @property
    def verdict(self) -> str:
        """The sentence that sums it up."""
        if self.fault:
            return "failed."
        measured = len(self.lights) - len(self.missing)
        known = "" if self.error_deg is None else f", known to {self.error_deg:.2g} degrees or better"
        lacks = f"; {', '.join(self.missing)} left out" if self.missing else ""
        return f"{counted(measured, 'light')}{known}{lacks}."


def worst_rigs_first(results: Iterable[RigResult]) -> tuple[RigResult, ...]:
    """Return takes in the order in which to look at them: those that failed, that lack lights, of which there is
    something to be said, and then the less certain ones."""
    return tuple(sorted(results, key=_badness))


def _badness(one: RigResult) -> tuple[bool, int, int, float, str]:
    return not one.fault, -len(one.missing), -len(one.findings), -(one.error_deg or 0.0), one.take.name


def rigs_record(results: Sequence[RigResult]) -> dict[str, object]:
    """Return the report as what report.json holds."""
    takes = [asdict(one) | {"take": str(one.take), "rig": one.rig.name, "usable": one.usable} for one in results]
    return {"schema": SCHEMA, "version": __version__, "takes": takes}


def rigs_page(results: Sequence[RigResult]) -> str:
    """Return the report as one self-contained HTML page, with links to every take's rig and picture."""
    failed, lacking = sum(bool(one.fault) for one in results), sum(bool(one.missing) for one in results)
    whole = len(results) - failed - lacking
    said = (
        f"{counted(len(results), 'take')}: {whole} with all lights, {lacking} without some, {failed} failed. A light "
        "is compared with where it stood, and how it shone, in the takes before."
    )
    return overview_page("Lights, take by take", said, [*map(_line, results)])


def _line(one: RigResult) -> TakeLine:
    grade = "bad" if not one.usable else "good" if not one.findings else "doubtful"
    picture = one.rig.with_suffix(".png")
    links = [] if one.fault else [(one.rig.name, quote(one.rig.name))]
    links += [("what was found on the sphere", quote(picture.name))] if picture.exists() else []
    words = (one.fault,) if one.fault else one.findings
    return TakeLine(
        name=one.take.name,
        grade=grade,
        verdict=one.verdict,
        address=links[-1][1] if links else "",
        section=take_section(one.take.name, grade, one.verdict, words, links=links) if words else "",
    )
