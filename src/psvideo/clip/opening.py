"""Opening a clip: its files found, its plan read, and the first frame's header held against the plan."""

from dataclasses import replace
from pathlib import Path

from psvideo.clip.decoders import read_header
from psvideo.clip.folder import MOVIES, find_sequence
from psvideo.clip.record import Clip, Header
from psvideo.clip.transfer import find_curve
from psvideo.errors import PsvideoError
from psvideo.plan import Plan
from psvideo.planfile import find_plan, read_plan


def open_clip(path: Path, *, plan: Path | None = None) -> Clip:
    """Open a folder of numbered images or a movie as a clip; no pixel is decoded yet.

    ``plan`` names the plan file where it does not lie beside the footage. Raises PsvideoError where the footage or its
    plan is missing, unclear, unreadable, or does not fit together.
    """
    if not path.exists():
        raise PsvideoError(f"{path}: there is no such clip. Name a folder of numbered frames, or a movie file.")
    if path.is_dir():
        return _open_folder(path, plan)
    raise PsvideoError(
        f"{path}: is neither a folder nor a movie ({', '.join(MOVIES)}). Name the folder that holds the frames."
    )


def _open_folder(path: Path, plan_path: Path | None) -> Clip:
    sequence = find_sequence(path)
    plan_path = find_plan(path, given=plan_path)
    plan = read_plan(plan_path)
    curve = find_curve(plan.camera.encoding.transfer)
    header = read_header(sequence.kind, sequence.files[0])
    check_fit(sequence.files[0], header, plan, plan_path)
    passed_over = f"left aside, having no number at the end: {', '.join(file.name for file in sequence.passed_over)}"
    return Clip(
        name=path.resolve().name,
        path=path,
        plan=plan,
        plan_path=plan_path,
        kind=sequence.kind,
        files=sequence.files,
        numbers=sequence.numbers,
        header=replace(header, cfa=header.cfa or plan.camera.encoding.cfa),
        colour=header.colour or curve.colour,
        notes=header.notes + ((passed_over,) if sequence.passed_over else ()),
    )


def check_fit(file: Path, header: Header, plan: Plan, plan_path: Path) -> None:
    """Refuse footage that is not what the plan says: another size, or another arrangement of colours."""
    camera = plan.camera
    if (header.width_px, header.height_px) != (camera.width_px, camera.height_px):
        raise PsvideoError(
            f"{file}: is {header.width_px} x {header.height_px} pixels, and {plan_path} says {camera.width_px} x "
            f"{camera.height_px}. Use the plan of this footage, or correct width_px and height_px in it."
        )
    cfa = camera.encoding.cfa
    if cfa is not None and header.channels == 3:
        raise PsvideoError(
            f"{file}: is a colour picture, and {plan_path} says cfa = {cfa!r}, which is for mosaiced frames of one "
            "channel. Leave cfa out of the plan."
        )
    if cfa is not None and header.cfa is not None and header.cfa != cfa:
        raise PsvideoError(
            f"{file}: says that its colour filters are {header.cfa} from the top left pixel on, and {plan_path} says "
            f"cfa = {cfa!r}. Leave cfa out of the plan: DNG files carry it themselves."
        )
