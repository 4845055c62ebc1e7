"""What the rounds of a take say of it once its flashes are known: a check's lines on timing, plates and normals."""

from psvideo.clip import Take
from psvideo.compute.progress import Watch
from psvideo.errors import PsvideoError
from psvideo.model.irradiance.colours import unmixing_of
from psvideo.model.plan import Plan
from psvideo.model.rig import LEAST_LIGHTS, Rig
from psvideo.model.timing import Timing
from psvideo.plates.gather import gather
from psvideo.plates.sequence import Round
from psvideo.report.judge.every_line import judgements
from psvideo.report.judge.of_accuracy import accuracy
from psvideo.report.judge.of_rows import MOST_UNSEEN
from psvideo.report.judge.of_validity import first_of_all, validity
from psvideo.report.judge.typical_error import NOISY_DEG, moves
from psvideo.report.judgement import Judgement
from psvideo.report.observe.observed import Observed
from psvideo.runs.instants.reporting import observing
from psvideo.runs.steps.levels import levels_of
from psvideo.runs.steps.saturation import saturation_of
from psvideo.solve.instants import surfaces
from psvideo.solve.normals.solving import Solving


def lines_of(take: Take, timing: Timing, known: Rig | None, *, watch: Watch) -> tuple[Judgement, ...]:
    """Judge a take's frames whose flashes are known. Raises PsvideoError where they hold no whole round."""
    plan = take.clip.plan
    unmixing = None if known is None else unmixing_of(plan, known, channels=take.clip.channels)
    apart = take.unmixed(unmixing)
    observed, solved = _observed(apart, timing, known if unmixing is None else unmixing.rig, watch)
    seen = Judgement(subject="strobe", grade="good", found=_strobe_words(plan, timing))
    judged = judgements(
        apart.plan,
        timing,
        observed,
        take_s=_whole_s(take),
        curve_doubt=take.clip.curve_doubt,
        saturation=saturation_of(take),
        levels=levels_of(take),
        foretold=True,
    )
    if solved is None or moves(observed.facts):  # plates of what moves are not brought together here
        return (seen, *judged)
    return (seen, *judged, *accuracy(solved), *validity(solved, first=first_of_all(judged)))


def _observed(take: Take, timing: Timing, rig: Rig | None, watch: Watch) -> tuple[Observed, Observed | None]:
    """Look at all whole rounds; return what they show, and what one of them alone shows that a rig could solve."""
    observed, solved = observing(take, rig), None
    for one in gather(take, timing, watch=watch, each_window=observed.look_at_window):
        observed.add(one)
        if rig is not None and not observed.closely.away and one.lights == take.plan.lights:
            solved = _look_at_normals(observed, one, take, rig)
        del one
    if not observed.facts:
        raise PsvideoError(
            f"{take.clip.path}: the frames looked at, {take.numbers[0]} to {take.numbers[-1]}, hold no round in "
            "which a light is complete. Film longer: a round needs as many frames as it has flashes, and one "
            "or two more."
        )
    return observed, solved


def _whole_s(take: Take) -> float | None:
    """Return how long a take is of which only a part is looked at."""
    numbers = take.clip.numbers
    partly = len(take.numbers) < len(numbers)
    return (numbers[-1] - numbers[0] + 1) * take.clip.plan.camera.frame_period_s if partly else None


def _look_at_normals(observed: Observed, one: Round, take: Take, rig: Rig) -> Observed | None:
    """Solve a round and look whether its normals are one surface's, trusted or not, and face outwards at its outline:
    directions that are mirrored, or lights exchanged, explain the plates as well. Near lights would need the surface's
    distance for it; noise belongs to no surface, nor does a round that was not seen whole.

    Returns what is seen of that round alone beside its normals, None where it was not solved or is noise.
    """
    plan = take.plan
    lights, whole = rig.select(plan.lights), observed.facts[-1].unseen_share <= MOST_UNSEEN
    if whole and len(lights) >= LEAST_LIGHTS and all(light.direction is not None for light in lights):
        surface = next(surfaces(iter([one]), plan, rig, solving=Solving(error=True))).surface
        if surface.misfit is None or surface.misfit.noise_deg < NOISY_DEG:
            alone = observing(take, rig)
            alone.add(one, surface)
            observed.closely.slopes += alone.closely.slopes
            observed.closely.away += alone.closely.away
            observed.closely.outward += alone.closely.outward
            return alone
    return None


def _strobe_words(plan: Plan, timing: Timing) -> str:
    flashes = sum(not flash.is_dark for flash in timing.flashes)
    if plan.mode == "synced":
        return f"{flashes} flashes, one a frame, as the plan says."
    return f"The strobe was seen: {flashes} flashes of {len(plan.lights)} lights, as planned."
