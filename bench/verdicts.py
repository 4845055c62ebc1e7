"""Verdicts on photographs: what `psvideo stills` says of subjects that were photographed, beside what is true of them.

``python -m bench.verdicts [PART OF A NAME [FOLDER]]`` prints what was found as well, and writes a picture of every
subject into the folder: normals, albedo, validity, predicted error, and the subject relit from the left and the right.
"""

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np

import psvideo as ps
from bench.accuracy_measure import SHARED_DATA, angles_deg, diligent_lights, washington_sphere
from bench.table import Row, table
from psvideo.formats.light_lists.light_list_writer import write_rig
from psvideo.model.rig import Light, Rig
from psvideo.report.judge.typical_error import MEAN_OF_HELD
from psvideo.report.run_report import RunReport

EIGHT, TWELVE = (4, 19, 27, 44, 52, 67, 75, 91), (1, 8, 18, 24, 37, 41, 50, 59, 66, 79, 85, 94)
CLOSE = 1.5
"""What a typical normal is said to be off by is right within this factor."""


@dataclass(frozen=True, kw_only=True)
class Subject:
    """Photographs, one per light, with what is known of them. ``truth`` (row, col, 3) is zero where it is not known;
    ``word`` is how the verdict should begin."""

    name: str
    pictures: list[Path]
    directions: np.ndarray
    strengths: np.ndarray | None = None
    mask: Path | None = None
    dark: Path | None = None
    transfer: str | None = None
    truth: np.ndarray | None = None
    word: str = "This take is usable"
    aside: tuple[int, ...] = field(default=())

    def choose(self, lights: tuple[int, ...]) -> "Subject":
        """Return the same subject under some of its lights."""
        chosen = list(lights)
        return Subject(
            name=f"{self.name.split(',')[0]}, {len(chosen)} lights",
            pictures=[self.pictures[n] for n in chosen],
            directions=self.directions[chosen],
            strengths=None if self.strengths is None else self.strengths[chosen],
            mask=self.mask,
            dark=self.dark,
            transfer=self.transfer,
            truth=self.truth,
            word=self.word,
        )

    def solved(self, folder: Path) -> RunReport:
        """Solve it as whoever took it would, into a folder."""
        taken = folder / "taken"
        taken.mkdir()
        for n, picture in enumerate(self.pictures):
            (taken / f"light{n:02d}{picture.suffix}").symlink_to(picture)
        strengths = np.ones((len(self.pictures), 1)) if self.strengths is None else self.strengths
        lights = tuple(
            Light(
                name=f"light{n:02d}",
                direction=(float(way[0]), float(way[1]), float(way[2])),
                intensity=tuple(map(float, strength)),
            )
            for n, (way, strength) in enumerate(zip(self.directions, strengths, strict=True))
        )
        write_rig(folder / "rig.toml", Rig(lights=lights))
        return ps.stills(
            taken,
            out=folder / "out",
            lights=folder / "rig.toml",
            mask=self.mask,
            dark=self.dark,
            transfer=self.transfer,
            aov=["error", "source"],
            rti=False,
        )


def subjects() -> Iterator[Subject]:
    """Give the photographed subjects, as whoever took them would hand them over."""
    for thing in ("bear", "cat"):
        whole = _diligent(SHARED_DATA / "diligent_photos" / thing, thing)
        if thing == "bear":  # its first 19 photographs are a quarter brighter than their list says
            whole = replace(whole, word="This take is doubtful")
        yield whole
        yield whole.choose(TWELVE)
        yield whole.choose(EIGHT)
    ball = _diligent(SHARED_DATA / "diligent_ball", "ball")
    yield ball
    yield ball.choose((0, 5, 9, 14, 17, 22, 27, 31, 34, 38, 43, 46))
    for thing in ("gray", "cat", "horse"):
        yield _washington(thing)
    for thing in ("cat", "frog", "hippo"):
        yield _harvard(thing)
    for thing, listed in (("fossil", "fossil_derived.lp"), ("univr_example", "dirs.lp")):
        folder = SHARED_DATA / "rti" / thing
        lines = [line.split() for line in (folder / listed).read_text().splitlines()[1:] if line.strip()]
        mask = folder / "mask.png"
        yield Subject(
            name=f"RTI {thing}, {len(lines)} lights",
            pictures=[folder / words[0] for words in lines],
            directions=_unit(np.array([words[1:4] for words in lines], np.float64)),
            mask=mask if mask.is_file() else None,
        )
    folder = SHARED_DATA / "led_rig_butterfly"
    ways = _unit(np.loadtxt(folder / "lights_from_source.txt"))
    yield Subject(
        name="butterfly, 8 LEDs in a narrow ring",
        pictures=[folder / f"image{n}.png" for n in range(8)],
        directions=ways,
        dark=folder / "image_ambient.png",
        word="This take is",
    )


def _unit(ways: np.ndarray) -> np.ndarray:
    return np.asarray(ways / np.linalg.norm(ways, axis=1, keepdims=True))


def _diligent(folder: Path, name: str) -> Subject:
    files, directions, strengths = diligent_lights(folder)
    return Subject(
        name=f"DiLiGenT {name}, {len(files)} lights",
        pictures=files,
        directions=directions,
        strengths=strengths,
        mask=folder / "mask.png",
        transfer="linear",
        truth=np.load(folder / "normal_gt.npy").astype(np.float64),
    )


def _washington(thing: str) -> Subject:
    folder = SHARED_DATA / "uw_psm"
    words = (folder / "lights.txt").read_text().split()
    truth = None
    if thing == "gray":
        case = washington_sphere()
        truth = np.where(case.mask[..., None], case.truth, 0)
    return Subject(
        name=f"Washington {thing}, 12 lights",
        pictures=[folder / thing / f"{thing}.{n}.png" for n in range(12)],
        directions=_unit(np.array(words[1:], np.float64).reshape(12, 3)),
        mask=folder / thing / f"{thing}.mask.png",
        transfer="linear",
        truth=truth,
    )


def _harvard(thing: str) -> Subject:
    folder = SHARED_DATA / "harvard_ps" / thing
    words = (folder / "refined_light.txt").read_text().replace(",", " ").split()
    vectors = np.array(words, np.float64).reshape(3, -1).T
    sizes = np.linalg.norm(vectors, axis=1, keepdims=True)
    pictures = [folder / "Objects" / f"Image_{n:02d}.png" for n in range(1, len(vectors) + 1)]
    return Subject(
        name=f"Harvard {thing}, {len(vectors)} lights",
        pictures=pictures,
        directions=vectors / sizes,
        strengths=sizes / sizes.mean(),
        transfer="linear",
    )


def rows(only: str = "", *, said: bool = False, kept: Path | None = None) -> Iterator[Row]:
    """Give the verdict on every subject whose name contains ``only``."""
    for subject in subjects() if SHARED_DATA.is_dir() else ():
        if only not in subject.name:
            continue
        with tempfile.TemporaryDirectory() as place:
            report = subject.solved(Path(place))
            figures, met = _figures(subject, report, Path(place) / "out")
            if kept is not None:
                kept.mkdir(parents=True, exist_ok=True)
                _write_picture(kept / f"{subject.name.replace(' ', '_').replace(',', '')}.png", Path(place) / "out")
        if said:
            print(f"\n{subject.name}: {report.verdict}\n  {figures}\n  " + "\n  ".join(report.findings), flush=True)
        yield Row(
            subject.name, f"{report.verdict} {figures}", subject.word, met and report.verdict.startswith(subject.word)
        )


def _figures(subject: Subject, report: RunReport, out: Path) -> tuple[str, bool]:
    """Return what is true of the result, in words, and whether what the report says of the rig agrees."""
    facts = report.instants[0]
    said = f"{100 * (facts.valid_share or 0):.0f} % trusted"
    deg = None if facts.likely_deg is None else MEAN_OF_HELD * facts.likely_deg
    said += "" if deg is None else f", said to be off by {deg:.1f}°"
    if subject.truth is None:
        return said, True
    whole = np.linalg.norm(subject.truth, axis=-1) > 0.5
    normals, valid, error = (_image(next((out / kind).glob("*.exr"))) for kind in ("normals", "valid", "error"))
    shown = whole & (np.linalg.norm(normals, axis=-1) > 0.5)
    off, trusted = angles_deg(normals[shown], subject.truth[shown]), valid[shown] > 0.5
    held = [100 * np.mean(off <= times * error[shown]) for times in (1, 2)]
    said += (
        f"; truth: {off.mean():.1f}° (median {np.median(off):.1f}°), trusted {off[trusted].mean():.1f}°, "
        f"{100 * np.mean(off[trusted] > 10):.1f} % of them over 10°; {held[0]:.0f} % within the predicted error, "
        f"{held[1]:.0f} % within twice"
    )
    return said, deg is None or 1 / CLOSE <= deg / float(off.mean()) <= CLOSE


def _write_picture(path: Path, out: Path) -> None:
    names = ("normals", "albedo", "valid", "error")
    normals, albedo, valid, error = (_image(next((out / kind).glob("*.exr"))) for kind in names)
    surface = ps.Surface(
        normals=normals, albedo=albedo, valid=valid > 0.5, source=(albedo.max(axis=-1) > 0).astype("u1")
    )
    shown = [ps.picture_of(name, one) for name, one in zip(names, (normals, albedo, valid, error), strict=True)]
    sides = [ps.relight(surface, (x, 0.3, 0.7)) for x in (-0.65, 0.65)]
    shown += [ps.picture_of("beauty", np.asarray(side)) for side in sides]
    cv2.imwrite(str(path), np.hstack(shown)[..., ::-1])


def _image(path: Path) -> np.ndarray:
    import OpenEXR

    with OpenEXR.File(str(path)) as file:
        held = file.channels()
        return np.asarray(next(iter(held.values())).pixels, np.float32)


if __name__ == "__main__":
    part, folder = [*sys.argv[1:], "", ""][:2]
    print(table(list(rows(part, said=True, kept=Path(folder) if folder else None))))
