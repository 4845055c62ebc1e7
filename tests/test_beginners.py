"""Mistakes of people who use psvideo for the first time, as docs/mistakes.md lists them: what is said to each."""

import shutil
from collections.abc import Callable
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

import psvideo as ps
from psvideo.cli.app import main
from psvideo.inspect.describe import describe

ROOT = Path(__file__).resolve().parents[1]
Picture = NDArray[np.float64]
LIGHTS = np.array([[0.5 * np.cos(at), 0.5 * np.sin(at), np.sqrt(0.75)] for at in np.radians(range(0, 360, 60))])
NAMES = [f"shot {n}" for n in (3, 7, 8, 20, 21, 22)]
Y, X = (np.mgrid[:48, :48] - 23.5) / 20
INSIDE = X**2 + Y**2 < 1


def lit() -> list[Picture]:
    """Return a matte ball under each of the lights, with a little noise."""
    normals = np.stack([X, -Y, np.sqrt(np.maximum(1 - X**2 - Y**2, 0))], axis=-1)
    grain = np.random.default_rng(4).normal(0, 0.001, (len(LIGHTS), *X.shape))
    return [np.where(INSIDE, 0.7 * np.maximum(normals @ at, 0), 0) + one for at, one in zip(LIGHTS, grain, strict=True)]


def save(path: Path, light: Picture, *, codes: int = 65535) -> None:
    kind = np.uint16 if codes > 255 else np.uint8
    cv2.imwrite(str(path), (codes * np.clip(light, 0, 1) + 0.5).astype(kind))


def photographs(folder: Path, pictures: list[Picture]) -> Path:
    folder.mkdir()
    for name, picture in zip(NAMES, pictures, strict=True):
        save(folder / f"{name}.png", picture)
    return folder


def listed(path: Path) -> Path:
    path.write_text("\n".join([str(len(LIGHTS)), *(" ".join(map(str, at)) for at in LIGHTS.tolist()), ""]))
    return path


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("beginners") / "clip"
    assert main(["synth", str(ROOT / "data_synth/sphere.toml"), "-o", str(folder), "-q"]) == 0
    return folder


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Return what a command says on stderr, in one line; it must not fail with a traceback."""

    def run(*words: object, status: int = 1) -> str:
        assert main([str(word) for word in words]) == status
        error = capsys.readouterr().err
        assert "Traceback" not in error
        return " ".join(error.replace("│", " ").split())

    return run


def movie(clip: Path, path: Path) -> Path:
    """Write a clip's frames as a ProRes movie, its plan beside it."""
    shutil.copy(clip / "plan.toml", path.with_name("plan.toml"))
    with av.open(str(path), "w") as container:
        stream = container.add_stream("prores_ks", rate=100)
        stream.width, stream.height, stream.pix_fmt = 160, 120, "yuv422p10le"
        for file in sorted((clip / "frames").iterdir()):
            picture = cv2.imread(str(file))
            assert picture is not None
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture.astype(np.uint8), format="bgr24")))
        container.mux(stream.encode())
    return path


WRONG_PLACE = {
    "no command": (["{clip}"], 2, "the command comes first. psvideo info {clip}"),
    "another program's name of an option": (
        ["normals", "{clip}", "--rig", "{clip}/rig.toml", "--preset", "nuke", "-o", "{tmp}/o"],
        2,
        "no option --preset; did you mean --for?",
    ),
    "one clip as two cameras": (
        ["sync", "{clip}", "{clip}"],
        2,
        "{clip}: named twice; expected the clips of",
    ),
    "the clip for the results": (
        ["normals", "{clip}", "--rig", "{clip}/rig.toml", "-o", "{clip}"],
        2,
        "exists already and holds a plan.toml: it is footage, and not replaced",
    ),
    "a command misspelled": (["normal", "{clip}"], 2, "there is no command 'normal'; did you mean 'normals'?"),
    "no rig": (["normals", "{tmp}/bare", "-o", "{tmp}/o"], 2, "the file that says where the lights are"),
    "the folder above": (["sync", "{day}"], 1, "A clip lies in it: name {clip}."),
    "the frames alone": (["sync", "{clip}/frames"], 1, "there is no plan.toml here, but one folder up"),
    "the plan for the clip": (["sync", "{clip}/plan.toml"], 1, "Name the folder that holds the frames, such as {clip}"),
    "a frame for the clip": (["sync", "{frame}"], 1, "Name the folder that holds the frames, such as {clip}."),
    "photographs for a clip": (["sync", "{tmp}/photos"], 1, "Photographs, one per light, need none: psvideo stills"),
    "a clip for photographs": (
        ["stills", "{clip}", "--lights", "{tmp}/lights.lp", "-o", "{tmp}/o"],
        1,
        "It is a clip with its plan: psvideo normals takes it.",
    ),
    "plates for a clip": (["normals", "{tmp}/plates", "--rig", "{clip}/rig.toml", "-o", "{tmp}/o"], 1, "name the clip"),
    "a photograph for the lights": (
        ["stills", "{tmp}/photos", "--lights", "{tmp}/photos/shot 3.png", "-o", "{tmp}/o"],
        1,
        "is not text",
    ),
    "raw video of a maker": (["sync", "{tmp}/a.braw"], 1, "export it with its maker's program, as DNG, EXR or ProRes"),
    "no unit": (
        ["capture-plan", "--camera", "Sony F65", "--fps", "120", "--lights", "a,b,c", "--flash", "0.8"],
        2,
        "Write a number and its unit, such as 0.8ms",
    ),
}


@pytest.mark.parametrize("case", WRONG_PLACE)
def test_what_is_named_instead_of_what_was_meant_is_answered_by_what_to_name(
    case: str, clip: Path, tmp_path: Path, said: Callable[..., str]
) -> None:
    photographs(tmp_path / "photos", lit())
    listed(tmp_path / "lights.lp")
    (tmp_path / "a.braw").write_bytes(b"\0" * 64)
    (tmp_path / "plates" / "key").mkdir(parents=True)
    (tmp_path / "plates" / "timing.json").write_text("{}")
    words, status, expected = WRONG_PLACE[case]
    shutil.copytree(clip, tmp_path / "bare", ignore=shutil.ignore_patterns("rig.toml"))
    places = {"clip": clip, "day": clip.parent, "tmp": tmp_path, "frame": next((clip / "frames").iterdir())}
    assert expected.format(**places) in said(*(word.format(**places) for word in words), status=status)
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("name", ["--take3", "-take3"])
def test_a_folder_called_like_an_option_is_told_how_to_name_it(
    name: str, clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: Callable[..., str]
) -> None:
    shutil.copytree(clip, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    words = said("info", name, status=2)
    assert f"{name} is a file or folder here, and what begins with - is read as an option; name it ./{name}." in words
    said("info", f"./{name}", status=0)
    assert "No such option: --take4" in said("info", "--take4", status=2)


Spoil = Callable[[Path, Path], None]


def rewritten(change: Callable[[str], str]) -> Spoil:
    def spoil(_: Path, lights: Path) -> None:
        lights.write_text(change(lights.read_text()))

    return spoil


def only(*names: str) -> Spoil:
    def spoil(folder: Path, _: Path) -> None:
        for name in NAMES:
            if name not in names:
                (folder / f"{name}.png").unlink()

    return spoil


def of_a_phone(folder: Path, _: Path) -> None:
    for name in NAMES:
        (folder / f"{name}.png").rename(folder / f"{name}.HEIC")


def raw_and_jpeg(folder: Path, _: Path) -> None:
    for name, picture in zip(NAMES, lit(), strict=True):
        save(folder / f"{name}.jpg", picture, codes=255)


def one_twice(folder: Path, _: Path) -> None:
    shutil.copy(folder / "shot 3.png", folder / "shot 7.png")


def angles(_: Path, lights: Path) -> None:
    lights.write_text("\n".join(["6", *(f"{name}.png,{place * 60},60" for place, name in enumerate(NAMES))]))


def angles_and_distance(_: Path, lights: Path) -> None:
    lights.write_text("\n".join(["6", *(f"{name}.png {place * 60} 60 1" for place, name in enumerate(NAMES))]))


def as_windows_writes(_: Path, lights: Path) -> None:
    lights.write_text(f"# für die Vase\n{lights.read_text()}", encoding="cp1252")


def of_one_picture(_: Path, lights: Path) -> None:
    names = [NAMES[0], NAMES[0], *NAMES[2:]]
    rows = lights.read_text().splitlines()[1:]
    lights.write_text("\n".join(["6", *(f'"{name}.png" {row}' for name, row in zip(names, rows, strict=True))]))


def jpegs_called_png(folder: Path, _: Path) -> None:
    for file in folder.iterdir():
        save(file.with_suffix(".jpg"), np.full((64, 64), 0.5), codes=255)
        file.with_suffix(".jpg").replace(file)
        file.write_bytes(file.read_bytes() + file.name.encode())


def all_alike(words: bytes) -> Spoil:
    def spoil(folder: Path, _: Path) -> None:
        for file in folder.iterdir():
            file.write_bytes(words)

    return spoil


PHOTOGRAPHS: dict[str, tuple[Spoil, str]] = {
    "one picture only": (only("shot 3"), "holds 1 picture of lights (shot 3.png). Normals need three at least"),
    "two pictures": (only("shot 3", "shot 7"), "Normals need three at least, each under another light"),
    "as a phone saves them": (of_a_phone, "shot 20.HEIC (and 5 more) is HEIC, which is not read"),
    "every picture as JPEG too": (raw_and_jpeg, "shot 3.jpg and shot 3.png are one photograph in two kinds"),
    "one picture under two names": (one_twice, "shot 3.png and shot 7.png are one and the same picture"),
    "copied as empty files": (all_alike(b""), "png: is empty"),
    "a server's page for every picture": (all_alike(b"<html>not found</html>"), "does not begin like a PNG file"),
    "one picture for two lights": (
        of_one_picture,
        "shot 3.png: lights.lp gives it to light 1 (shot 3.png) and to light 2 (shot 3.png)",
    ),
    "umlauts as Windows writes them": (as_windows_writes, "may be a 'ü' as Windows writes it). Save it as UTF-8"),
    "decimal commas": (rewritten(lambda text: text.replace(".", ",")), "Expected numbers with points, such as 0.5"),
    "angles": (angles, "expected three numbers x y z of a direction"),
    "angles and a distance": (angles_and_distance, "such as 0 60 1, look like angles in degrees"),
    "JPEGs called PNG": (jpegs_called_png, "does not begin like a PNG file, but like JPEG. Give it the ending .jpg"),
    "z away from the camera": (
        rewritten(lambda text: text.replace(" 0.8", " -0.8")),
        "every light stands behind the subject (z is -0.87 at most)",
    ),
}


@pytest.mark.parametrize("case", PHOTOGRAPHS)
def test_photographs_and_lists_that_cannot_be_meant_are_refused_before_any_work(case: str, tmp_path: Path) -> None:
    folder, lights = photographs(tmp_path / "photos", lit()), listed(tmp_path / "lights.lp")
    spoil, expected = PHOTOGRAPHS[case]
    spoil(folder, lights)
    with pytest.raises(ps.PsvideoError) as fault:
        ps.stills(folder, lights=lights, out=tmp_path / "out")
    assert expected in str(fault.value)
    assert "\n" not in str(fault.value)
    assert not (tmp_path / "out").exists()


def test_folders_with_spaces_and_umlauts_and_lists_with_windows_line_ends_are_read(tmp_path: Path) -> None:
    folder, lights = photographs(tmp_path / "Fotos für Ärzte", lit()), listed(tmp_path / "Lichter 1.lp")
    lights.write_bytes(b"\xef\xbb\xbf" + lights.read_bytes().replace(b"\n", b"\r\n"))
    report = ps.stills(folder, lights=lights, out=tmp_path / "Ergebnis für später")
    assert [light.name for light in report.lights] == NAMES


def test_a_list_in_utf_16_is_named_so(tmp_path: Path) -> None:
    (tmp_path / "lights.lp").write_text("1\n0 0 1\n", encoding="utf-16")
    with pytest.raises(ps.PsvideoError, match=r"lights\.lp: is text in UTF-16\. Save it as UTF-8"):
        ps.read_rig(tmp_path / "lights.lp")


def test_a_table_with_semicolons_is_read_as_it_is_meant(tmp_path: Path) -> None:
    rows = [f"{name}.png;{x};{y};{z}" for name, (x, y, z) in zip(NAMES, LIGHTS.tolist(), strict=True)]
    (tmp_path / "lights.csv").write_text("\n".join(["file;x;y;z", *rows]))
    assert ps.read_rig(tmp_path / "lights.csv").lights[3].direction == pytest.approx(tuple(LIGHTS[3]))


def test_a_dark_picture_beside_the_others_is_none_of_a_light_and_a_forgotten_one_is_mentioned(tmp_path: Path) -> None:
    folder, lights = photographs(tmp_path / "photos", lit()), listed(tmp_path / "lights.lp")
    without = ps.stills(folder, lights=lights, out=tmp_path / "out")
    assert "No picture is named dark or ambient, so the room is assumed dark" in str(without.shot["Remarks"])
    save(folder / "shot 30.png", np.full_like(lit()[0], 0.001))
    report = ps.stills(folder, lights=lights, dark=folder / "shot 30.png", out=tmp_path / "out", force=True)
    assert "shot 30.png shows the ambient light, which was taken off" in str(report.shot["Remarks"])


def unlit(pictures: list[Picture]) -> list[Picture]:
    return [0.0005 * np.random.default_rng(place).random(one.shape) for place, one in enumerate(pictures)]


def test_pictures_taken_with_the_cap_on_are_called_dark_once(tmp_path: Path) -> None:
    folder, lights = photographs(tmp_path / "photos", unlit(lit())), listed(tmp_path / "lights.lp")
    report = ps.stills(folder, lights=lights, out=tmp_path / "out")
    assert "not usable" in report.verdict
    assert sum("dark" in warning or "lit" in warning for warning in report.findings) == 1


def test_a_mask_that_is_inverted_is_named(tmp_path: Path) -> None:
    folder, lights = photographs(tmp_path / "photos", lit()), listed(tmp_path / "lights.lp")
    cv2.imwrite(str(tmp_path / "mask.png"), (255 * ~INSIDE).astype(np.uint8))
    report = ps.stills(folder, lights=lights, mask=tmp_path / "mask.png", out=tmp_path / "out")
    assert "mask" in report.verdict
    assert any("the mask may be inverted" in warning for warning in report.findings)


def test_results_may_lie_in_the_clip_and_nothing_of_it_changes(clip: Path, tmp_path: Path) -> None:
    copy = tmp_path / "clip"
    shutil.copytree(clip, copy)
    words = ["normals", str(copy), "--rig", str(copy / "rig.toml"), "-q", "-o"]
    before = sorted(copy.rglob("*"))
    assert main([*words, str(copy / "out")]) == 0
    assert main([*words, str(copy / "frames" / "out")]) == 0
    assert main(["sync", str(copy), "-q", "-o", str(tmp_path / "timing.json")]) == 0
    kept = [path for path in sorted(copy.rglob("*")) if "out" not in path.parts[len(copy.parts) :]]
    assert kept == before


@pytest.mark.parametrize("case", ["encrypted", "empty", "broken off", "no movie"])
def test_a_movie_that_cannot_be_read_says_why(case: str, clip: Path, tmp_path: Path, said: Callable[..., str]) -> None:
    take = movie(clip, tmp_path / "take.mov")
    whole = take.read_bytes()
    spoilt, expected = {
        "encrypted": (whole.replace(b"apch", b"encv"), "is encrypted. Expected a movie as the camera recorded it"),
        "empty": (b"", "is empty (0 bytes). Copy it again"),
        "broken off": (whole[: len(whole) * 2 // 3], "is truncated: of the "),
        "no movie": (b"hello", "truncated, damaged or of a kind that is not read"),
    }[case]
    assert spoilt != whole
    take.write_bytes(spoilt)
    assert expected in said("sync", take)
    assert any(expected in finding.text for finding in describe(take).findings if finding.level == "FAULT")
