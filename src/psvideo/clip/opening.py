"""Opening a clip: its files found, its plan read, and the first frame's header compared with the plan."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from psvideo.clip.decode.decoders import read_header
from psvideo.clip.decode.movies.yuv import signal_range
from psvideo.clip.decoded import Header
from psvideo.clip.filters import check_filters
from psvideo.clip.folder import MOVIES, RAWS, NumberedImages, find_sequence, unread
from psvideo.clip.linear import depth_held, level_warning
from psvideo.clip.record import Clip
from psvideo.clip.stated import stated_by
from psvideo.clip.tagged_curve import disagreement, is_another_curve
from psvideo.clip.transfer import DISPLAYED, find_curve
from psvideo.errors import PsvideoError
from psvideo.formats.clip_layout import FRAMES, find_plan
from psvideo.formats.plan_toml import read_plan
from psvideo.model.camera import Encoding
from psvideo.model.plan import Plan

if TYPE_CHECKING:
    pass
from psvideo.clip.movie_rate import places_a_frame, rate_warning, varying_rate

PROFILED = ("png", "tiff", "jpeg")
"""Kinds of pictures that name their curve by a profile or in chunks; one that is close to the plan's is not spoken of,
as profiles name sRGB and a gamma of 2.2 for each other."""


def open_clip(path: Path, *, plan: Path | None = None) -> Clip:
    """Open a folder of numbered images or a movie as a clip; of a movie, the first frame is decoded.

    ``plan`` names the plan file where it does not lie beside the footage. Raises PsvideoError where the footage or its
    plan is missing, unclear, unreadable, or does not fit together.
    """
    if not path.exists():
        raise PsvideoError(f"{path}: there is no such clip. Name a folder of numbered frames, or a movie file.")
    if path.is_dir():
        return _open_folder(path, plan)
    if path.suffix.lower() in MOVIES:
        return _open_movie(path, plan)
    advice = unread(path) or f"Name the folder that holds the frames, such as {_folder_of(path)}."
    raise PsvideoError(f"{path}: is neither a folder nor a movie ({', '.join(MOVIES)}). {advice}")


def _folder_of(file: Path) -> Path:
    """Return the clip's folder that a file may belong to."""
    return file.parent.parent if file.parent.name == FRAMES else file.parent


def _open_folder(path: Path, plan_path: Path | None) -> Clip:
    sequence = find_sequence(path)
    plan_path = find_plan(path, given=plan_path)
    plan = read_plan(plan_path)
    header = _tagged(sequence, read_header(sequence.kind, sequence.files[0]))
    check_fit(sequence.files[0], header, plan, plan_path)
    encoding = _encoding(sequence.kind, plan, plan_path)
    passed_over = f"left aside, having no number at the end: {', '.join(file.name for file in sequence.passed_over)}"
    return Clip(
        name=path.resolve().name,
        path=path,
        plan=plan,
        plan_path=plan_path,
        kind=sequence.kind,
        files=sequence.files,
        numbers=sequence.numbers,
        header=header,
        colour=header.colour or find_curve(encoding.transfer).colour,
        encoding=encoding,
        curve_doubt=_curve_doubt(sequence.kind, plan, header),
        warnings=header.warnings + _curve_warnings(sequence.kind, plan, header) + level_warning(header, encoding),
        notes=((passed_over,) if sequence.passed_over else ())
        + header.notes
        + _depth_note(header, encoding)
        + _turn_note(header),
    )


def _tagged(sequence: NumberedImages, header: Header) -> Header:
    """Return the header with the curve that the first file's profile or chunks name, and how it says that it lies,
    where the decoder found none."""
    if sequence.kind not in PROFILED:
        return header
    said = stated_by(sequence.files[0])
    curve = None if said.transfer == "unknown" else said.transfer
    turn = said.turn if header.turn.is_none else header.turn
    return replace(header, transfer=header.transfer or curve, turn=turn)


def _open_movie(path: Path, plan_path: Path | None) -> Clip:
    from psvideo.clip.decode.movies.movie import index_movie

    plan_path = find_plan(path, given=plan_path)
    plan = read_plan(plan_path)
    movie = index_movie(path)
    check_fit(path, movie.header, plan, plan_path)
    encoding, notes = _expanded(_encoding("movie", plan, plan_path), movie.header)
    rate_warnings = rate_warning(movie, plan) if movie.rates_hz is None else varying_rate(path, movie, plan)
    per_frame = places_a_frame(movie, plan)
    camera = replace(plan.camera, fps=plan.camera.fps * per_frame)
    return Clip(
        name=path.stem,
        path=path,
        plan=replace(plan, camera=camera),
        plan_path=plan_path,
        kind="movie",
        files=(path,),
        numbers=movie.places,
        header=movie.header,
        colour=_movie_colour(encoding, movie.header),
        encoding=encoding,
        timestamps=movie.timestamps,
        curve_doubt=_curve_doubt("movie", plan, movie.header),
        warnings=movie.header.warnings
        + _curve_warnings("movie", plan, movie.header)
        + level_warning(movie.header, encoding)
        + rate_warnings,
        places_per_frame=per_frame,
        notes=movie.header.notes + notes + _turn_note(movie.header),
    )


def _encoding(kind: str, plan: Plan, plan_path: Path) -> Encoding:
    """Return how the codes are read: as the plan says, but DNG is linear. Raises PsvideoError for unknown curves."""
    encoding = plan.camera.encoding
    try:
        find_curve(encoding.transfer)
    except PsvideoError as fault:
        raise PsvideoError(f"{plan_path}: {fault}") from None
    return replace(encoding, transfer="linear") if kind in RAWS else encoding


def _expanded(encoding: Encoding, header: Header) -> tuple[Encoding, tuple[str, ...]]:
    """Leave out levels that are the ends of video range: they are 0 and 1 already where the range is expanded."""
    ends = signal_range(header.bits or 8, video_range=True)
    if not header.video_range or (encoding.black_level, encoding.white_level) != ends:
        return encoding, ()
    return replace(encoding, black_level=None, white_level=None), (
        "the plan's levels are the ends of video range, which is expanded before the curve is taken off",
    )


def _movie_colour(encoding: Encoding, header: Header) -> str:
    """Return the colour of a movie's light: by its tag where its curve goes with several gamuts, else the curve's."""
    curve = find_curve(encoding.transfer)
    return (header.colour or curve.colour) if curve.name in DISPLAYED else curve.colour


def _depth_note(header: Header, encoding: Encoding) -> tuple[str, ...]:
    """Say where the plan's white level shows that files hold fewer bits than they could."""
    if header.bits is None or header.signal_per_code is not None:
        return ()
    held = depth_held(header.bits, encoding)
    if held == header.bits:
        return ()
    return (
        f"by the plan's white_level the files hold {held} bits in {header.bits}; the curve is taken off codes of "
        f"0 to {2**held - 1}",
    )


def _turn_note(header: Header) -> tuple[str, ...]:
    if header.turn.is_none:
        return ()
    size = "{} x {} pixels".format(*header.turn.size(header.width_px, header.height_px))
    return (f"the pictures are {header.turn}, as their file asks: plates and results are {size}",)


def _curve_warnings(kind: str, plan: Plan, header: Header) -> tuple[str, ...]:
    """Say where the plan names another curve than the files have."""
    transfer = plan.camera.encoding.transfer
    if kind in RAWS:
        linear = find_curve(transfer).name == "linear"
        said = f"{kind.upper()} files hold linear light, so the plan's transfer = {transfer!r} is not applied"
        return () if linear else (said,)
    wrong = disagreement(transfer, tagged=header.transfer, kind=kind)
    if kind in PROFILED and header.transfer and not is_another_curve(transfer, header.transfer):
        return ()
    return () if wrong is None else (wrong,)


def _curve_doubt(kind: str, plan: Plan, header: Header) -> str:
    """Return the warning that the plan names another curve where that one is so far off that it tilts all normals."""
    transfer = plan.camera.encoding.transfer
    said = "" if kind in RAWS else disagreement(transfer, tagged=header.transfer, kind=kind) or ""
    return said if said and is_another_curve(transfer, header.transfer) else ""


def check_fit(file: Path, header: Header, plan: Plan, plan_path: Path) -> None:
    """Refuse footage that is not what the plan says: another size, or another arrangement of colours."""
    camera = plan.camera
    if (header.width_px, header.height_px) != (camera.width_px, camera.height_px):
        if header.turn.size(header.width_px, header.height_px) == (camera.width_px, camera.height_px):
            raise PsvideoError(
                f"{file}: is to be {header.turn}; {plan_path} says {camera.width_px} x {camera.height_px} pixels, "
                f"which is how it is shown. A plan counts the sensor's own rows, one after the other in time: write "
                f"width_px = {header.width_px} and height_px = {header.height_px}. Plates and results stand upright."
            )
        raise PsvideoError(
            f"{file}: is {header.width_px} x {header.height_px} pixels, and {plan_path} says {camera.width_px} x "
            f"{camera.height_px}. Use the plan of this footage, or correct width_px and height_px in it."
        )
    check_filters(file, header, camera.encoding.cfa, plan=plan_path)
