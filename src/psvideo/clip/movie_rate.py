"""How a movie's rate goes with its plan's: what to say where they differ, and how many of its places a frame takes."""

from pathlib import Path
from typing import TYPE_CHECKING

from psvideo.errors import PsvideoError
from psvideo.model.plan import Plan

if TYPE_CHECKING:
    from psvideo.clip.decode.movies.movie import Movie

RATE_TOLERANCE = 5e-4
"""A movie's rate counts as the plan's within this share: tighter than 120 for 119.88."""


def rate_warning(movie: "Movie", plan: Plan) -> tuple[str, ...]:
    """Say where a movie plays at another rate than the plan's."""
    fps = float(plan.camera.fps)
    if movie.rate_hz is None or abs(movie.rate_hz / fps - 1) < RATE_TOLERANCE + movie.rate_error:
        return ()
    shot_hz = movie.capture_rate_hz
    if shot_hz is not None and abs(shot_hz / fps - 1) < RATE_TOLERANCE + movie.rate_error:
        return ()
    if shot_hz is not None and abs(shot_hz / movie.rate_hz - 1) > RATE_TOLERANCE + movie.rate_error:
        return (
            f"the movie says that it was shot at {shot_hz:.6g} frames per second, and the plan says {fps:.6g}, which "
            "is taken: correct fps in the plan where the movie is right",
        )
    return (
        f"the movie plays at {movie.rate_hz:.6g} frames per second and the plan says {fps:.6g}; the plan's is taken, "
        "as for high-speed footage that plays slowed down",
    )


def varying_rate(path: Path, movie: "Movie", plan: Plan) -> tuple[str, ...]:
    """Say that a movie's rate varies. Raises PsvideoError where one flash was fired for each frame."""
    low, high = movie.rates_hz or (0.0, 0.0)
    rates = f"varies from {low:.4g} to {high:.4g} frames per second"
    if plan.mode == "synced":
        raise PsvideoError(
            f"{path}: its rate {rates}; the plan is synced, with one flash for each frame, and expects an even rate. "
            "Record at a constant frame rate."
        )
    return (
        f"the rate {rates}; every frame is taken at the time that the file says, the exposure time for constant. Lock "
        "exposure and frame rate",
    )


def places_a_frame(movie: "Movie", plan: Plan) -> int:
    """Return how many of a movie's places there are from one frame of the plan's rate to the next."""
    if movie.place_rate_hz is None or movie.per_frame == 1:
        return 1
    ratio = movie.place_rate_hz / float(plan.camera.fps)
    whole = max(round(ratio), 1)
    return whole if abs(ratio / whole - 1) < RATE_TOLERANCE + movie.rate_error else movie.per_frame
