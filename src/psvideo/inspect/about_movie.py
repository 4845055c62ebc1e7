"""What a movie says of itself, where no plan is there to hold it against."""

from collections.abc import Iterator
from pathlib import Path

from psvideo.clip.reading import looks
from psvideo.inspect.findings import Description, Finding, caught, ok, warn
from psvideo.model.units import counted


def movie_findings(path: Path) -> Iterator[Finding]:
    """Yield what a movie's file says of its pictures and times. Raises PsvideoError where it cannot be read."""
    from psvideo.clip.decode.movies.movie import index_movie

    movie = index_movie(path)
    head = movie.header
    missing = 0 if movie.rates_hz is not None else movie.places[-1] - movie.places[0] + 1 - len(movie.places)
    gaps = f", {missing} missing" if missing else ""
    rate = "" if movie.rate_hz is None else f", {movie.rate_hz:.4g} frames a second"
    if movie.rates_hz is not None:
        rate = f", from {movie.rates_hz[0]:.4g} to {movie.rates_hz[1]:.4g} frames a second"
    shot = "" if movie.capture_rate_hz is None else f", shot at {movie.capture_rate_hz:.4g}"
    yield ok(f"{counted(len(movie.places), 'frame')}{gaps}{rate}{shot}: movie, {looks(head)}")
    if not head.turn.is_none:
        upright = "{} x {}".format(*head.turn.size(head.width_px, head.height_px))
        yield ok(f"shown {head.turn}, {upright} pixels upright; a plan's size is the sensor's, before turning")
    range_ = "video range" if head.video_range else "full range"
    yield ok(f"transfer {head.transfer or 'not said'}, primaries {head.colour or 'not said'}, {range_}")
    yield from (warn(text) for text in head.warnings)
    yield from (ok(text) for text in head.notes)


def describe_preview(path: Path, results: Path) -> Description:
    """Describe a movie for eyes that lies among results or plates: no footage, so that it needs no plan."""
    findings = (*caught(movie_findings(path)), ok(f"a movie for eyes made from {results.name}, no footage"))
    return Description(path=path, kind="movie", findings=findings)
