"""What normals are solved with, read and checked before a long run begins."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path

from psvideo.clip import DepthMaps, Masks, Take, open_depth, open_masks
from psvideo.errors import PsvideoError, UsageError, said_of
from psvideo.export.sequences.result_files import Delivery
from psvideo.export.sequences.tags import sha256_of
from psvideo.formats.flat_toml import read_falloff
from psvideo.formats.rig_toml import read_rig
from psvideo.model.choices import MOST_ITERATIONS, NEAR_ITERATIONS
from psvideo.model.irradiance.colours import Unmixing, unmixing_of
from psvideo.model.irradiance.falloff import Falloff
from psvideo.model.irradiance.intensity import lights_as_planned
from psvideo.model.rig import Light, Rig
from psvideo.plates.sequence import check_separable
from psvideo.solve.depth import Shaping, view_of
from psvideo.solve.near_surface import NearSurface, near_surface_of, near_trust
from psvideo.solve.normals.illumination import illumination

UNSURE_DEG = 5.0
"""A rig whose own standard error is this large is named in the report; a guessed one says 20."""


@dataclass(frozen=True, kw_only=True)
class AskedLighting:
    """What a caller names beside the rig: where to solve (``mask``), how light falls off over the picture (``flat``),
    known ``depth`` and metres per unit of it (``depth_scale``), and how often near lights' surface is made again
    (``near_iterations``; None: once, and never where depth is known)."""

    mask: Path | None = None
    flat: Path | None = None
    near_iterations: int | None = None
    depth: Path | None = None
    depth_scale: float | None = None

    def check(self) -> None:
        """Raise UsageError where numbers cannot be meant, before anything is read."""
        if self.depth_scale is not None and self.depth is None:
            raise UsageError("`depth_scale` is for the file given as `depth`: give that as well, or leave it out.")
        if self.depth_scale is not None and not 0 < self.depth_scale < inf:
            raise UsageError(
                f"`depth_scale` {self.depth_scale:g}: expected metres per unit, above 0, of the file given as `depth`."
            )
        if self.near_iterations is not None and not 0 <= self.near_iterations <= MOST_ITERATIONS:
            raise UsageError(
                f"`near_iterations` {self.near_iterations}: expected a number from 0 to {MOST_ITERATIONS}."
            )


@dataclass(frozen=True, kw_only=True)
class Lighting:
    """What is solved with, read and checked before a long run begins: the rig, for near lights where the surface is
    taken to be, what is known of its depth, and where to solve. Where flashes hold several colours, ``unmixing`` takes
    them apart, ``rig`` holds the lamps that results show, and ``flashed`` the lights as they flash."""

    rig_path: Path
    rig: Rig
    condition: float
    unmixing: Unmixing | None = None
    flashed: Rig | None = None
    near: NearSurface | None = None
    masks: Masks | None = None
    depths: DepthMaps | None = None
    falloff: Falloff | None = None

    @property
    def shaping(self) -> Shaping:
        """How normals become depth, before the first instant."""
        known_m = None if self.depths is None else self.depths.first
        return Shaping(view=view_of(self.rig), plane=self.rig.plane, known_m=known_m)

    def shaping_at(self, shaping: Shaping, number: int) -> Shaping:
        """Return the shaping of the instant with this number: its known depth is its own where there are several."""
        if self.depths is None or self.depths.still is not None:
            return shaping
        return replace(shaping, known_m=self.depths.at(number))

    def check(self, delivery: Delivery) -> None:
        """Raise UsageError where depth is known and nothing of the run would use it."""
        if self.depths is not None and self.near is None and not delivery.needs_depth:
            raise UsageError(
                f"`depth` {self.depths.path}: nothing would use it. All lights of this rig are distant, so that "
                'normals do not depend on depth; add `aov=["depth"]`, `aov=["position"]` or `mesh`, or leave it '
                "out."
            )

    @property
    def metric(self) -> bool:
        """Whether depth comes in metres: the rig knows the lens, and the rig or a file how far away the surface is."""
        return self.rig.focal_px is not None and (self.rig.plane is not None or self.depths is not None)

    @property
    def identity(self) -> tuple[object, ...]:
        """What distinguishes this lighting from others: the rig's bytes and lights, mask, depth and falloff."""
        depths = () if self.depths is None else self.depths.identity
        return sha256_of(self.rig_path), self.rig, self.mask_sha256, self.falloff, self.near_iterations, *depths

    @property
    def near_iterations(self) -> int:
        """How often the surface is made again for near lights; 0 where there are none."""
        return 0 if self.near is None else self.near.iterations

    @property
    def near_notes(self) -> tuple[str, ...]:
        """What normals depend on where lights are near, in whole sentences."""
        return () if self.near is None else (near_trust(self.near),)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is to be distrusted about the rig itself, in whole sentences."""
        worst = max(self.rig.lights, key=lambda light: light.error_deg or 0.0)
        if (worst.error_deg or 0.0) < UNSURE_DEG:
            return ()
        return (
            f"The rig file itself says that its lights are known to {worst.error_deg:g} degrees only "
            f"({worst.name!r}): normals are wrong by about as much. Calibrate on a sphere.",
        )

    @property
    def mask_sha256(self) -> str | None:
        """The digest of the mask, or of all of a sequence; None where there is none."""
        return None if self.masks is None else self.masks.sha256


def read_lighting(take: Take, rig_path: Path, asked: AskedLighting = AskedLighting()) -> Lighting:
    """Read rig, mask and known depth of a take, a file or a folder with one per instant. Raises PsvideoError where they
    do not fit the plan, or give no normals."""
    clip = take.clip
    flashed = read_rig(rig_path, plan_lights=clip.plan.lights)
    unmixing = unmixing_of(clip.plan, flashed, channels=clip.channels)
    if unmixing is None:
        check_separable(clip.plan)
    rig, plan = (flashed, clip.plan) if unmixing is None else (unmixing.rig, unmixing.shown)
    lights = lights_as_planned(rig, plan)
    depths = None if asked.depth is None else _read_depth(take, rig, asked.depth, asked.depth_scale)
    iterations = asked.near_iterations
    if iterations is None:
        iterations = NEAR_ITERATIONS if depths is None else 0
    size = {"width_px": clip.width_px, "height_px": clip.height_px}
    with said_of(rig_path):
        near = near_surface_of(rig, lights, **size, iterations=iterations, depths=depths)
        lit = illumination(lights, channels=clip.channels, ground=None if near is None else near.ground)
    if near is None and asked.near_iterations:
        raise UsageError(
            f"`near_iterations` {asked.near_iterations}: nothing would use it. All lights of {rig_path} are distant, "
            "so that normals do not depend on where the surface is; leave it out."
        )
    masks = None if asked.mask is None else open_masks(asked.mask, **size)
    falloff = None if asked.flat is None else _read_falloff(asked.flat, take, lights)
    return Lighting(
        rig_path=rig_path,
        rig=rig,
        condition=lit.condition,
        unmixing=unmixing,
        flashed=flashed,
        near=near,
        masks=masks,
        depths=depths,
        falloff=falloff,
    )


def _read_falloff(path: Path, take: Take, lights: Sequence[Light]) -> Falloff:
    """Read a flat field; raises PsvideoError where it lacks a light, before a long run begins."""
    falloff = read_falloff(path, width_px=take.clip.width_px, height_px=take.clip.height_px)
    for light in lights:
        falloff.field(light.name)
    return falloff


def _read_depth(take: Take, rig: Rig, path: Path, metres_per_unit: float | None) -> DepthMaps:
    if rig.focal_px is None:
        raise PsvideoError(
            f"`depth` {path}: needs the camera's perspective. Add to the rig file: [camera] focal_px = [f, f] (the "
            "focal length in mm times pixels per mm of the sensor)."
        )
    clip = take.clip
    return open_depth(path, width_px=clip.width_px, height_px=clip.height_px, metres_per_unit=metres_per_unit)
