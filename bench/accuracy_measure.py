"""What the accuracy tables share: their rows, angles between normals, lights on rings, virtual and real scenes."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from psvideo.model.surface import Surface
from psvideo.solve.normals.illumination import Illumination
from psvideo.synth import read_scene
from psvideo.synth.stage import set_stage
from psvideo.synth.subject.shading import light_collected
from psvideo.synth.truth import true_normals

ROOT = Path(__file__).resolve().parents[1]
SHARED_DATA = ROOT.parent / "shared" / "data"


class Accuracy(NamedTuple):
    """A fault or a subject. ``before`` is the result as it is, ``after`` the one with the remedy; ``bar`` is empty and
    ``met`` None where none is set."""

    what: str
    before: str = ""
    remedy: str = ""
    after: str = ""
    bar: str = ""
    met: bool | None = None


class Case(NamedTuple):
    """A subject whose normals are known: a plate per light (row, col[, channel]), true normals, where they hold."""

    name: str
    plates: list[np.ndarray]
    lit: Illumination
    truth: np.ndarray
    mask: np.ndarray

    def choose(self, lights: np.ndarray) -> "Case":
        """Return the same subject under some of its lights."""
        lit = Illumination(directions=self.lit.directions[lights], intensities=self.lit.intensities[lights])
        return self._replace(plates=[self.plates[n] for n in lights], lit=lit)


def errors_deg(surface: Surface, case: Case, where: np.ndarray | None = None) -> np.ndarray:
    """Angles to the true normals, where the surface is valid and the truth known."""
    both = surface.valid & case.mask & (True if where is None else where)
    return angles_deg(surface.normals[both], case.truth[both])


def read_image(path: Path, how: int = cv2.IMREAD_COLOR) -> np.ndarray:
    """Return a picture as OpenCV reads it. Raises FileNotFoundError where there is none."""
    image = cv2.imread(str(path), how)
    if image is None:
        raise FileNotFoundError(path)
    return np.asarray(image)


def angles_deg(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Angles between unit normals, good to small fractions of a degree."""
    found = found.astype(np.float64)
    found = found / np.linalg.norm(found, axis=-1, keepdims=True)
    apart = np.linalg.norm(found - truth, axis=-1)
    return np.asarray(np.degrees(2 * np.arcsin(np.clip(apart / 2, 0, 1))))


def described(errors: np.ndarray) -> str:
    """Return errors as words: their mean and median."""
    return f"{errors.mean():.2f}° (median {np.median(errors):.2f}°)"


def ring(lights: int, slant_deg: float) -> np.ndarray:
    """Unit directions evenly around the camera's axis."""
    around, slant = 0.3 + np.arange(lights) * 2 * np.pi / lights, np.radians(slant_deg)
    up = np.full(lights, np.cos(slant))
    return np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), up], axis=-1)


def matte_ball(lights: int, *, reach_deg: float = 50.0, slant_deg: float = 35.0, albedo: float = 0.43) -> Case:
    """The subject of the physics page's table: a ball as far as 50 degrees from its middle, lights 35 off the axis."""
    size = 96
    radius = (size - 1) / 2 / np.sin(np.radians(reach_deg))
    rows, cols = np.mgrid[:size, :size] - (size - 1) / 2
    x, y = cols / radius, -rows / radius
    inside = x * x + y * y < np.sin(np.radians(reach_deg)) ** 2
    truth = np.where(inside[..., None], np.stack([x, y, np.sqrt(np.where(inside, 1 - x * x - y * y, 0))], axis=-1), 0)
    lit = Illumination(directions=ring(lights, slant_deg), intensities=np.ones((lights, 1)))
    shade = np.maximum(0, np.einsum("rcx,lx->lrc", truth, lit.directions)) * albedo
    return Case(f"ball, {lights} lights", list(shade.astype(np.float32)), lit, truth, inside)


def gloss(
    lights: tuple[int, ...] = tuple(range(8)),
    *,
    scale: float = 1.0,
    noise: float = 0.0,
    roughness: float | None = None,
    directions: np.ndarray | None = None,
) -> Case:
    """The scene data_synth/gloss.toml under some of its lights; what is beyond 1.0 is clipped.

    ``scale`` multiplies the highlights' share, ``roughness`` is set for all that shines, ``noise`` is added.
    ``directions`` (light, 3) stand in for the scene's own lights.
    """
    scene = read_scene(ROOT / "data_synth" / "gloss.toml")
    shiny = [
        table
        if table.specular is None
        else table.model_copy(
            update={
                "specular": table.specular.model_copy(
                    update={
                        "strength": table.specular.strength * scale,
                        "roughness": table.specular.roughness if roughness is None else roughness,
                    }
                )
            }
        )
        for table in scene.object
    ]
    stage = set_stage(scene.model_copy(update={"object": shiny}), ROOT / "data_synth")
    assert stage.still is not None
    hits, chosen = stage.still.hits, [stage.rig.lights[n] for n in lights]
    if directions is not None:
        chosen = [replace(chosen[0], direction=(float(x), float(y), float(z))) for x, y, z in directions]
    rng = np.random.default_rng(1)
    plates = [hits.image(light_collected(stage.still, light)) for light in chosen]
    noisy = [np.minimum(plate + rng.normal(0, noise, plate.shape), 1).astype(np.float32) for plate in plates]
    truth = true_normals(hits)
    towards = np.array([light.direction for light in chosen], np.float64)
    lit = Illumination(directions=towards, intensities=np.full((len(chosen), 3), chosen[0].intensity[0]))
    return Case(f"gloss, {len(chosen)} lights", noisy, lit, truth, np.linalg.norm(truth, axis=-1) > 0.5)


def turned(case: Case, wrong_deg: float) -> Case:
    """Return the case as solved with a rig whose every direction is off by so much, each its own way."""
    true = case.lit.directions
    across = np.random.default_rng(2).normal(size=true.shape)
    across -= np.sum(across * true, axis=1, keepdims=True) * true
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    claimed = np.cos(np.radians(wrong_deg)) * true + np.sin(np.radians(wrong_deg)) * across
    return case._replace(lit=Illumination(directions=claimed, intensities=case.lit.intensities))


def diligent_lights(folder: Path) -> tuple[list[Path], np.ndarray, np.ndarray]:
    """Return a DiLiGenT folder's pictures, and their lights' directions and strengths by channel, 1 in the mean."""
    with (folder / "lights.csv").open() as file:
        listed = [row for row in csv.reader(file) if row[0].endswith(".png")]
    numbers = np.array([[float(word) for word in row[1:7]] for row in listed])
    return [folder / row[0] for row in listed], numbers[:, :3], numbers[:, 3:] / numbers[:, 3:].mean()


def diligent(folder: Path, name: str) -> Case:
    """Photographs of DiLiGenT with their true normals."""
    files, directions, strengths = diligent_lights(folder)
    plates = [read_image(file, cv2.IMREAD_UNCHANGED)[..., ::-1] / np.float32(65535) for file in files]
    lit = Illumination(directions=directions, intensities=strengths)
    mask = read_image(folder / "mask.png", cv2.IMREAD_GRAYSCALE) > 127
    plates = [np.ascontiguousarray(plate, np.float32) for plate in plates]
    return Case(name, plates, lit, np.load(folder / "normal_gt.npy").astype(np.float64), mask)


def diligent_ball() -> Case:
    """The ball of DiLiGenT, 48 lights."""
    return diligent(SHARED_DATA / "diligent_ball", "DiLiGenT ball")


def photographed(thing: str) -> Case:
    """Photographs of DiLiGenT's bear or cat, 96 lights."""
    return diligent(SHARED_DATA / "diligent_photos" / thing, thing)


def rendered_bunny() -> Case:
    """Another renderer's bunny with cast shadows, 25 lights."""
    data = np.load(SHARED_DATA / "bunny_rendered" / "bunny_lambert.npz")
    lit = Illumination(directions=data["lights"].astype(np.float64), intensities=np.ones((len(data["lights"]), 3)))
    plates = list(data["images"].astype(np.float32) * 5)
    return Case("rendered bunny", plates, lit, data["normal_gt"].astype(np.float64), data["mask"])


def washington(thing: str) -> Case:
    """A subject of the University of Washington (gray, cat or horse), 12 lights, 8 bits.

    Its rig is wrong by 1 to 8 degrees. The normals are known of "gray" only, a matte sphere.
    """
    folder = SHARED_DATA / "uw_psm"
    words = (folder / "lights.txt").read_text().split()
    directions = np.array(words[1:], np.float64).reshape(int(words[0]), 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    paths = [folder / thing / f"{thing}.{n}.png" for n in range(len(directions))]
    plates = [(read_image(path)[..., ::-1] / 255).astype(np.float32) for path in paths]
    rows, cols = np.mgrid[: plates[0].shape[0], : plates[0].shape[1]]
    x, y = (cols - 244.5) / 108.0, (144.5 - rows) / 108.0
    truth = np.stack([x, y, np.sqrt(np.maximum(1 - x * x - y * y, 0))], axis=-1)
    mask = x * x + y * y < 0.95**2
    if thing != "gray":
        truth = np.full_like(truth, np.nan)
        mask = read_image(folder / thing / f"{thing}.mask.png", cv2.IMREAD_GRAYSCALE) > 127
    lit = Illumination(directions=directions, intensities=np.ones((len(directions), 3)))
    return Case(f"Washington's {thing}", plates, lit, truth, mask)


def washington_sphere() -> Case:
    """The matte sphere of the University of Washington."""
    return washington("gray")


def spread_subsets(directions: np.ndarray, lights: int, count: int, *, most_condition: float = 4.0) -> list[np.ndarray]:
    """Random sets of lights whose directions' condition number shows that they are well spread."""
    rng = np.random.default_rng(0)
    found: list[np.ndarray] = []
    while len(found) < count:
        chosen = np.sort(rng.choice(len(directions), lights, replace=False))
        values = np.linalg.svd(directions[chosen], compute_uv=False)
        if values[0] <= most_condition * values[2]:
            found.append(chosen)
    return found
