"""What a run is asked for and what comes of it, as records: the whole job, a piece of it, what was found."""

from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property

from psvideo.clip import Take
from psvideo.errors import UsageError
from psvideo.export.sequences.result_files import Delivery
from psvideo.export.sequences.tags import Tags
from psvideo.model.arrays import Pixels
from psvideo.model.choices import Solver
from psvideo.model.irradiance.intensity import lights_as_planned
from psvideo.model.plan import Plan
from psvideo.model.surface import Subject
from psvideo.model.timing import Timing
from psvideo.plates.align.comb import Comb
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.part import Part
from psvideo.plates.sequence import AMBIENT, FIRST_NUMBER
from psvideo.report.observe.observed import Observed
from psvideo.runs.delivery.delivering import passes_asked
from psvideo.runs.steps.lighting import Lighting
from psvideo.runs.steps.output import tags_of
from psvideo.solve.depth import Shaping
from psvideo.solve.normals.solving import Solving
from psvideo.solve.passes.asked_passes import AskedPasses


@dataclass(frozen=True, kw_only=True)
class OverTime:
    """What is done between instants: how plates are brought to one, and how many results are averaged at rest."""

    aligning: Aligning = field(default_factory=Aligning)
    denoise: int = 1

    def check(self, plan: Plan, *, unmixed: bool = False) -> None:
        """Raise UsageError where a plan has no instant of its own for every light, and one is asked for; flashes that
        are separated by colour (``unmixed``) show all their lights at once."""
        if isinstance(self.aligning.rate, Comb) and self.aligning.align == "none":
            raise UsageError(
                "`fps` asks for instants between the flashes, and `align='none'` makes none: plates would be repeated. "
                "Leave one of the two out."
            )
        alone = unmixed or all(len(plan.flashes[slot].lit) == 1 for slot in plan.lit_slots)
        once = unmixed or len(plan.lit_slots) == len(plan.lights)
        if self.aligning.rate == "flash" and not (alone and once):
            raise UsageError(
                '`fps="flash"` needs a plan in which every light flashes once a round, by itself; in this one lights '
                "flash together, or several times. Leave it out: one result per round is given."
            )


@dataclass(frozen=True, kw_only=True)
class Job:
    """What all pieces of a run have in common: the take and its timing, what it is solved with, what is delivered.

    ``subject`` is what its rounds share, None where nobody looked yet or each round is by itself. ``shown_at_hz`` is
    the rate of the sequence where pictures have none of their own.
    """

    take: Take
    timing: Timing
    lighting: Lighting
    delivery: Delivery
    solver: Solver = "auto"
    over_time: OverTime = field(default_factory=OverTime)
    fill: bool = True
    start_number: int = FIRST_NUMBER
    subject: Subject | None = None
    shown_at_hz: Fraction | None = None

    @property
    def solving(self) -> Solving:
        """How normals are solved."""
        return Solving(
            solver=self.solver,
            half=self.delivery.half,
            residual="residual" in self.delivery.aovs,
            error="error" in self.delivery.aovs,
            fill=self.fill,
            subject=self.subject,
        )

    @property
    def aligning(self) -> Aligning:
        """How plates are brought to one instant, by lights whose place is known."""
        how = self.over_time.aligning
        if self.take.unmixing is not None:
            return how
        near = self.lighting.near
        lights = lights_as_planned(self.lighting.rig, self.take.plan)
        return replace(how, lights=lights, ground=None if near is None else near.ground)

    @property
    def asked(self) -> AskedPasses:
        """Which passes are made beside the surface."""
        return passes_asked(self.delivery)

    @cached_property
    def tags(self) -> Tags:
        """What every file says of itself."""
        tags = tags_of(self.take.clip, self.lighting.rig_path, self.delivery.space, self.over_time.aligning.rate)
        return tags if self.shown_at_hz is None else replace(tags, fps=self.shown_at_hz)

    @property
    def shaping(self) -> Shaping | None:
        """How normals become depth before the first instant, None where no depth is asked for."""
        return self.lighting.shaping if self.delivery.needs_depth else None

    @property
    def mixes_ambient(self) -> bool:
        """Whether ambient light is a part of the beauty plate."""
        return self.delivery.mix.of(AMBIENT) > 0


@dataclass(frozen=True, kw_only=True)
class Beginning:
    """What a clip's first instant leaves to all others.

    number: its own. whites: by light, what sketches of plates take for white. watched, white: whose plates the report
    looks for motion in, and what it takes for white. shaping: begun with its depth, None where none is asked for.
    """

    number: int
    whites: dict[str, float]
    watched: str
    white: float | None
    shaping: Shaping | None


@dataclass(frozen=True, kw_only=True)
class Piece:
    """A range of a run's instants that is solved by itself: their ``numbers``, what is read for them, and what the
    clip's first instant left, None where they begin with it."""

    numbers: range
    part: Part
    beginning: Beginning | None


@dataclass(kw_only=True)
class Found:
    """What instants gave: what was seen of them, a picture of one round, and in whole sentences what is not known of
    their depth, and what its ``scale`` is, empty where no depth was asked for."""

    observed: Observed
    picture: Pixels | None = None
    reserved: tuple[str, ...] = ()
    scale: str = ""

    def followed_by(self, other: "Found") -> None:
        """Take in what was found of the instants after these."""
        self.observed.followed_by(other.observed)
        self.picture = self.picture if other.picture is None else other.picture
        self.reserved = self.reserved or other.reserved
        self.scale = self.scale or other.scale
