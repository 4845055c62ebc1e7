"""The front door: its names, that they load only when used, and what arrays in and out answer to mistakes."""

import ast
import doctest
import importlib
import inspect
import pydoc
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import psvideo as ps
from psvideo.clip.decode import exr
from psvideo.errors import UsageError
from psvideo.solve.depth import Depth, View

ROOT = Path(__file__).resolve().parents[1]
SOURCE = Path(ps.__file__).read_text(encoding="utf-8")
DIRECTIONS = np.array([[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], [0.0, 0.6, 0.8], [0.0, -0.6, 0.8]])


def python(script: str) -> str:
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_importing_psvideo_loads_no_room_and_no_library() -> None:
    script = """
        import sys, psvideo as ps
        assert set(ps.__all__) < set(dir(ps))
        print(sorted(name for name in sys.modules if name.startswith("psvideo.") or name in ("numpy", "numba", "cv2")))
    """
    assert python(inspect.cleandoc(script)) == "[]"


def test_an_error_or_a_record_loads_no_solver() -> None:
    loaded = python("import sys, psvideo as ps; ps.PsvideoError, ps.Light; print('numba' in sys.modules)")
    assert loaded == "False"


def test_every_name_is_there_and_is_what_type_checkers_see() -> None:
    seen = {
        alias.asname or alias.name: f"{node.module}.{alias.name}"
        for block in ast.parse(SOURCE).body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert set(seen) == set(ps.__all__) == set(ps._HOMES)
    for name, path in seen.items():
        found = getattr(ps, name)
        assert f"{found.__module__}.{found.__name__}" == path, name


def test_a_room_of_the_same_name_does_not_take_a_functions_place() -> None:
    script = """
        import psvideo as ps, psvideo.solve.images, psvideo.sync.find
        from psvideo import solve, sync
        print(ps.solve is solve, callable(solve), callable(sync))
    """
    assert python(inspect.cleandoc(script)) == "True True True"


def test_a_module_in_a_room_of_the_same_name_is_imported_under_a_name_of_ones_own() -> None:
    script = """
        import psvideo.solve.images as images, psvideo.solve.normals.least_squares.woodham1980 as least_squares
        import psvideo as ps, psvideo.sync.find as find, psvideo.solve.depth.view as imported_later
        print(images.__name__, least_squares.__name__, find.__name__, ps.solve.depth.view is imported_later)
    """
    names = "psvideo.solve.images psvideo.solve.normals.least_squares.woodham1980 psvideo.sync.find True"
    assert python(inspect.cleandoc(script)) == names


def test_a_function_in_a_room_of_the_same_name_is_replaced_by_its_dotted_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("psvideo.solve.images.solve_images", None)
    assert importlib.import_module("psvideo.solve.images").solve_images is None


@pytest.mark.parametrize("name", ["solve", "sync"])
def test_a_function_with_a_room_of_its_name_shows_its_own_parameters_and_words(name: str) -> None:
    function = getattr(ps, name)
    assert next(iter(inspect.signature(function).parameters)) == {"solve": "take", "sync": "clip"}[name]
    assert "Raises" in (inspect.getdoc(function) or "")
    assert f"{name}(" in pydoc.render_doc(function)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'solv'"):
        ps.solv  # noqa: B018


FUNCTIONS = [name for name in ps.__all__ if inspect.isfunction(getattr(ps, name))]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_has_sections_and_an_example_that_runs_as_it_stands(name: str) -> None:
    text = inspect.getdoc(getattr(ps, name)) or ""
    sections = ["Raises\n------", "Examples\n--------"]
    for section in sections:
        assert section in text, section
    assert "Returns\n-------" in text or "Yields\n------" in text
    examples = doctest.DocTestParser().get_examples(text)
    assert examples
    assert not any(doctest.SKIP in one.options for one in examples)
    assert not [one for one in inspect.signature(getattr(ps, name)).parameters if one not in text]


def pictures(normal: tuple[float, float, float], *, albedo: float = 0.5, colour: bool = False) -> np.ndarray:
    shade = albedo * np.maximum(DIRECTIONS @ np.array(normal), 0)
    shape = (1, 3, 5, 3) if colour else (1, 3, 5)
    images: np.ndarray = (shade.reshape(-1, *[1] * (len(shape) - 1)) * np.ones(shape)).astype(np.float64)
    return images


NORMAL = (0.1, -0.2, float(np.sqrt(0.95)))


@pytest.mark.parametrize("solver", ["auto", "least-squares", "robust"])
@pytest.mark.parametrize("colour", [False, True])
def test_arrays_in_give_the_normal_that_they_were_made_with(solver: Any, colour: bool) -> None:
    surface = ps.solve_images(pictures(NORMAL, colour=colour), DIRECTIONS, solver=solver)
    np.testing.assert_allclose(surface.normals, np.broadcast_to(NORMAL, (3, 5, 3)), atol=1e-5)
    np.testing.assert_allclose(surface.albedo, 0.5, atol=1e-5)
    assert surface.albedo.shape == ((3, 5, 3) if colour else (3, 5))
    assert surface.valid.all()
    assert surface.residual is not None
    assert surface.error_deg is not None
    assert (surface.error_deg < 2).all()


def test_a_list_codes_and_another_scale_say_the_same_as_floats() -> None:
    images = pictures(NORMAL)
    same = ps.solve_images(images, DIRECTIONS)
    listed = ps.solve_images(list(images), DIRECTIONS.tolist())
    codes = np.round(images * 4000 + 64).astype(np.uint16)
    coded = ps.solve_images(codes, DIRECTIONS, black_level=64, white_level=4064)
    large = ps.solve_images(images * 1000, DIRECTIONS, saturation=1000.0)
    endless = ps.solve_images(images * 1000, DIRECTIONS, saturation=np.inf)
    np.testing.assert_array_equal(listed.normals, same.normals)
    np.testing.assert_allclose(coded.normals, same.normals, atol=1e-3)
    np.testing.assert_allclose(large.normals, same.normals, atol=1e-5)
    np.testing.assert_allclose(large.albedo, 1000 * same.albedo, rtol=1e-5)
    np.testing.assert_allclose(endless.albedo, 1000 * same.albedo, rtol=1e-5)


def test_strengths_and_a_rig_say_how_strong_the_lights_are() -> None:
    strengths = np.array([1.0, 0.5, 2.0, 1.5])
    images = pictures(NORMAL, albedo=0.25) * strengths[:, None, None]
    given = ps.solve_images(images, DIRECTIONS, intensities=strengths)
    lights = tuple(
        ps.Light(name=str(n), direction=(x, y, z), intensity=(strength,))
        for n, ((x, y, z), strength) in enumerate(zip(DIRECTIONS.tolist(), strengths.tolist(), strict=True))
    )
    by_rig = ps.solve_images(images, ps.Rig(lights=lights))
    np.testing.assert_allclose(given.normals[1, 2], NORMAL, atol=1e-5)
    np.testing.assert_array_equal(given.normals, by_rig.normals)


def test_only_what_the_mask_allows_is_solved() -> None:
    mask = np.zeros((3, 5), bool)
    mask[1] = True
    np.testing.assert_array_equal(ps.solve_images(pictures(NORMAL), DIRECTIONS, mask=mask).valid, mask)


def test_near_lights_of_a_rig_are_solved_where_its_plane_lies() -> None:
    positions_m = DIRECTIONS - [0, 0, 0.8]
    lights = tuple(
        ps.Light(name=name, position_m=(x, y, z)) for name, (x, y, z) in zip("abcd", positions_m, strict=True)
    )
    rig = ps.Rig(lights=lights, focal_px=(1000.0, 1000.0), principal_px=(2.0, 1.0), plane=(0.0, 0.0, 1.0, 1.0))
    away = positions_m - [0, 0, -1]
    distance = np.linalg.norm(away, axis=1)
    images = np.broadcast_to((0.5 * away[:, 2] / distance**3)[:, None, None], (4, 3, 5))
    surface = ps.solve_images(images, rig)
    np.testing.assert_allclose(surface.normals[1, 2], (0, 0, 1), atol=0.01)


GOOD = pictures(NORMAL)
SURFACE = ps.Surface(normals=np.ones((3, 5, 3)), albedo=np.ones((3, 5)), valid=np.ones((3, 5), bool))
LIGHTS = tuple(ps.Light(name=str(n), direction=(x, y, z)) for n, (x, y, z) in enumerate(DIRECTIONS.tolist()))
NOT_TYPED: Any = ps
"""The front door as callers without a type checker use it."""
MISTAKES: dict[str, tuple[Callable[[], object], str]] = {
    "codes": (lambda: ps.solve_images((GOOD * 255).astype(np.uint8), DIRECTIONS), "integer codes .uint8.*white_level"),
    "floats of codes": (lambda: ps.solve_images(GOOD * 255, DIRECTIONS), "100% of the pixels are at or above 1"),
    "levels for floats": (lambda: ps.solve_images(GOOD, DIRECTIONS, white_level=255), "belong to integer codes"),
    "levels swapped": (
        lambda: ps.solve_images(GOOD.astype(int), DIRECTIONS, white_level=1, black_level=2),
        "`white_level` 1 is not above `black_level` 2",
    ),
    "light last": (lambda: ps.solve_images(np.moveaxis(GOOD, 0, -1), DIRECTIONS), r"np.moveaxis\(images, -1, 0\)"),
    "one picture": (lambda: ps.solve_images(GOOD[0], DIRECTIONS), r"have shape \(3, 5\), 2 axes. Expected \(light"),
    "with alpha": (lambda: ps.solve_images(np.ones((4, 3, 5, 4)), DIRECTIONS), "without alpha"),
    "one channel": (lambda: ps.solve_images(GOOD[..., None], DIRECTIONS), r"give images\[..., 0\]"),
    "no pixels": (lambda: ps.solve_images(GOOD[:, :0], DIRECTIONS), "there are no pixels"),
    "nothing": (lambda: ps.solve_images([], DIRECTIONS), "expected an array"),
    "sizes": (lambda: ps.solve_images([*GOOD[:3], GOOD[3, :2]], DIRECTIONS), "image 0 is .3, 5. and image 3 is .2, 5."),
    "complex": (lambda: ps.solve_images(GOOD * 1j, DIRECTIONS), "type complex128; expected floats"),
    "NaN": (lambda: ps.solve_images(np.where(GOOD > 0.4, np.nan, GOOD), DIRECTIONS), "values that are not numbers"),
    "lights behind": (lambda: ps.solve_images(GOOD, DIRECTIONS * [1, 1, -1]), "change the sign of z"),
    "two lights": (lambda: ps.solve_images(GOOD[:2], DIRECTIONS[:2]), "at least three lights, and here are 2"),
    "a light more": (lambda: ps.solve_images(GOOD[:3], DIRECTIONS), "3 images .* and 4 lights"),
    "three lights for colours": (
        lambda: ps.solve_images(np.repeat(np.asarray(GOOD)[..., None], 3, axis=-1), DIRECTIONS[:3]),
        r"4 images .* and 3 lights.*in the same order\.$",
    ),
    "in a plane": (lambda: ps.solve_images(GOOD[:3], [[0.6, 0, 0.8], [0.0, 0, 1], [-0.6, 0, 0.8]]), "in one plane"),
    "turned": (lambda: ps.solve_images(GOOD, DIRECTIONS.T), "give directions.T"),
    "no unit": (lambda: ps.solve_images(GOOD, 2 * DIRECTIONS), "number 0 has length 2"),
    "not numbers": (lambda: ps.solve_images(GOOD, "lights.txt"), "not an array of numbers"),
    "strengths": (lambda: ps.solve_images(GOOD, DIRECTIONS, intensities=[1, 2]), r"expected \(4,\) or \(4, 1\)"),
    "dark light": (lambda: ps.solve_images(GOOD, DIRECTIONS, intensities=[1, 1, 1, 0]), "numbers above 0"),
    "mask's type": (lambda: ps.solve_images(GOOD, DIRECTIONS, mask=np.ones((3, 5))), "mask > 0"),
    "mask's size": (
        lambda: ps.solve_images(GOOD, DIRECTIONS, mask=np.ones((5, 3), bool)),
        r"expected \(3, 5\) of bool",
    ),
    "no images": (lambda: ps.solve_images(np.empty((0, 4, 5)), np.empty((0, 3))), "There are no images"),
    "empty mask": (lambda: ps.solve_images(GOOD, DIRECTIONS, mask=np.zeros((3, 5), bool)), "False everywhere"),
    "saturation": (lambda: ps.solve_images(GOOD, DIRECTIONS, saturation=0), "above 0 from which on"),
    "solver": (lambda: ps.solve_images(GOOD, DIRECTIONS, solver="robst"), "did you mean 'robust'"),  # type: ignore[arg-type]
    "ragged": (lambda: ps.solve_images([[[1.0, 2.0], [3.0]], GOOD[0]], DIRECTIONS), "number 0 of type list"),
    "names": (lambda: ps.solve_images(["a.png", "b.png"], DIRECTIONS), r"number 0 of type str.*ps.read_images"),
    "one name": (lambda: ps.solve_images("stills/", DIRECTIONS), r"ps.read_images\(folder\)"),
    "a list of Lights": (lambda: NOT_TYPED.solve_images(GOOD, LIGHTS), r"ps.Rig\(lights="),
    "a rig's name": (lambda: ps.solve_images(GOOD, "rig.toml"), r"ps.read_rig\(path\)"),
    "saturation's type": (
        lambda: NOT_TYPED.solve_images(GOOD, DIRECTIONS, saturation="1"),
        "`saturation` is '1' .str.",
    ),
    "level's type": (lambda: NOT_TYPED.solve_images(GOOD, DIRECTIONS, white_level="9"), "`white_level` is '9' .str."),
    "normals for a surface": (
        lambda: NOT_TYPED.relight(GOOD[0], (0, 0, 1)),
        "`surface` is of type ndarray; expected a S",
    ),
    "masked pictures": (
        lambda: ps.solve_images(np.ma.masked_less(GOOD, 0.1), DIRECTIONS),
        "masked arrays.*with `mask`",
    ),
    "a list of masked pictures": (
        lambda: ps.solve_images([np.ma.masked_less(image, 0.1) for image in GOOD], DIRECTIONS),
        "masked arrays.*with `mask`",
    ),
    "no direction": (lambda: ps.solve_images(GOOD, DIRECTIONS * [[1], [1], [0], [1]]), "number 2 is .0, 0, 0."),
    "no light": (lambda: ps.solve_images(-np.asarray(GOOD), DIRECTIONS), "hold no light: the brightest.*black level"),
    "light taken away": (lambda: ps.relight(SURFACE, (0, 0, 1), gloss=-1), "`gloss` is -1; expected a number of 0 or"),
    "a number of colour": (lambda: NOT_TYPED.relight(SURFACE, (0, 0, 1), colour=0.5), "`colour` is 0.5; expected .red"),
    "a colour's name": (
        lambda: NOT_TYPED.relight(SURFACE, (0, 0, 1), colour="red"),
        "`colour` is 'red'; expected .red",
    ),
    "two strengths": (lambda: NOT_TYPED.relight(SURFACE, (0, 0, 1), strength=[1, 2]), "`strength` is of type list"),
    "color": (
        lambda: NOT_TYPED.relight(SURFACE, (0, 0, 1), color=(1, 0, 0)),
        "no parameter `color`; did you mean 'colou",
    ),
    "no place": (
        lambda: NOT_TYPED.normals("take3/", rig="rig.toml"),
        "psvideo.normals: missing a required.* 'out'; its param",
    ),
    "too much": (
        lambda: NOT_TYPED.read_plan("plan.toml", "more"),
        "too many positional arguments; its parameters are p",
    ),
    "depth of normals": (lambda: NOT_TYPED.find_depth(SURFACE.normals), "`surface` is of type ndarray"),
    "depth by a name": (lambda: NOT_TYPED.find_depth(SURFACE, "rig.toml"), "`rig` is 'rig.toml' .str.; expected a Rig"),
    "picture of a surface": (lambda: NOT_TYPED.picture_of("normals", SURFACE), "`image` is of type Surface"),
    "surface of lists": (lambda: NOT_TYPED.Surface(normals=[], albedo=[], valid=[]), "`normals` is of type list"),
    "a rig of directions": (lambda: NOT_TYPED.Rig(DIRECTIONS), "`lights` of a Rig are of type ndarray"),
    "a rig of one light": (lambda: NOT_TYPED.Rig(lights=LIGHTS[0]), "`lights` of a Rig are of type Light"),
    "an intensity": (lambda: NOT_TYPED.Light(name="a", direction=(0, 0, 1), intensity=0.8), "one number in a tuple"),
    "half a direction": (lambda: NOT_TYPED.Light(name="a", direction=(0, 1)), "`direction` is .0, 1.; expected three"),
    "a light nowhere": (lambda: ps.Light(name="a"), "neither of `direction` and `position_m`"),
    "timing of a path": (
        lambda: NOT_TYPED.find_timing("take3/"),
        r"`take` is 'take3/' .str.; expected a Take: ps.open_",
    ),
    "a path solved": (lambda: NOT_TYPED.solve("take3/", ps.Rig(LIGHTS)), "`take` is 'take3/'"),
    "a path gathered": (lambda: next(NOT_TYPED.gather("take3/", "timing.json")), "`take` is 'take3/'"),
    "no path": (lambda: NOT_TYPED.read_rig(None), "`path` is of type NoneType; expected a path"),
    "a rig for a path": (
        lambda: NOT_TYPED.normals("a/", rig=ps.Rig(LIGHTS), out="new/"),
        "`rig` is of type Rig; expected a",
    ),
    "direction": (lambda: ps.relight(ps.solve_images(GOOD, DIRECTIONS), (0, 0, 0)), "from the surface to the light"),
    "quantity": (lambda: ps.picture_of("normal", GOOD[0]), "did you mean 'normals'"),
    "picture": (lambda: ps.picture_of("normals", GOOD[0]), r"normals is expected as \(row, col, 3\)"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_answered_by_what_came_and_what_is_expected(mistake: str) -> None:
    call, words = MISTAKES[mistake]
    with pytest.raises(ps.PsvideoError, match=words):
        call()


def test_strengths_beside_a_rig_are_refused() -> None:
    rig = ps.Rig(lights=(ps.Light(name="a", direction=(0, 0, 1)),))
    with pytest.raises(UsageError, match="beside a Rig"):
        ps.solve_images(GOOD, rig, intensities=[1.0])


def test_what_is_missing_in_a_picture_is_shown_as_zero_is() -> None:
    depth = np.array([[1.0, np.nan], [2.0, np.inf]], np.float32)
    expected = ps.picture_of("depth", np.array([[1.0, 0.0], [2.0, 0.0]], np.float32))
    assert (ps.picture_of("depth", depth) == expected).all()


@pytest.mark.parametrize("name", ["normals", "albedo", "valid", "residual", "error", "depth", "position", "beauty"])
def test_every_quantity_becomes_a_picture(name: str) -> None:
    surface = ps.solve_images(pictures(NORMAL), DIRECTIONS, solver="robust")
    size = np.ones((3, 5), np.float32)
    none = size > 1
    depth = Depth(depth=2 * size, cut_east=none, cut_south=none, parts=1, metric=False, view=View())
    images = {
        "normals": surface.normals,
        "albedo": surface.albedo,
        "valid": surface.valid,
        "residual": surface.residual,
        "error": surface.error_deg,
        "depth": depth.depth,
        "position": depth.view.points(depth.depth),
        "beauty": ps.relight(surface, (0, 0, 1)),
    }
    image = images[name]
    assert image is not None
    picture = ps.picture_of(name, image)
    assert (picture.shape, picture.dtype) == ((3, 5, 3), np.dtype(np.uint8))


def test_a_take_solved_in_python_is_what_the_whole_run_writes(shelf: Path, tmp_path: Path) -> None:
    take, rig = ps.open_take(shelf / "take3"), ps.read_rig(shelf / "take3" / "rig.toml")
    solved = {one.round.number: one.surface for one in ps.solve(take, rig, ps.find_timing(take))}
    report = ps.normals(shelf / "take3", rig=shelf / "take3" / "rig.toml", out=tmp_path / "out", float32=True)
    assert [one.number for one in report.instants] == list(solved)
    for number, surface in solved.items():
        written = exr.decode(tmp_path / "out" / "normals" / f"take3_normals.{number}.exr").codes
        np.testing.assert_allclose(np.asarray(written, np.float32), surface.normals, atol=1e-6)
