"""Programs of others read what psvideo delivers as it was meant: OpenImageIO, FFmpeg and three.js."""

import base64
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest
from ball_delivery import NUMBERS, SIZE, ball, deliver
from picture_file import read_picture

from psvideo.export.preview_movie import write_movie
from psvideo.export.sequences.png_maps import PNG_MAX, encode_normals
from psvideo.export.space import Space

CLIENTS = Path(__file__).parent / "clients"
BIN = Path(sys.executable).parent
NUMBER = NUMBERS[1]
HALF, SINGLE, CODE = 5e-4, 1e-6, 2e-5
"""How far values may be off where files hold half floats, floats, or 16-bit codes."""


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return deliver(tmp_path_factory.mktemp("ball"), Space())


def tool(name: str, *words: str | Path) -> str:
    """Run one of OpenImageIO's programs and return what it says; a fault fails the test."""
    return subprocess.run([BIN / name, *words], capture_output=True, text=True, check=True).stdout


def truth(number: int) -> dict[str, np.ndarray]:
    """Return what every sequence should hold, by its folder."""
    normals, valid = ball(number)
    there = valid.astype(np.float32)
    depth = np.where(valid, 3 - normals[..., 2], 0)
    row, col = np.mgrid[:SIZE, :SIZE]
    place = np.stack([(col - (SIZE - 1) / 2) / SIZE, -(row - (SIZE - 1) / 2) / SIZE, -depth], axis=-1)
    return {
        "normals": normals,
        "albedo": np.repeat(0.5 * there[..., None], 3, axis=-1),
        "valid": there[..., None],
        "residual": 0.005 * there[..., None],
        "beauty": np.repeat(there[..., None], 3, axis=-1),
        "depth": depth[..., None],
        "position": place * there[..., None],
        "normals_png16": encode_normals(normals) / PNG_MAX,
        "valid_png16": there[..., None],
    }


def test_openimageio_finds_in_every_file_what_was_put_there(out: Path, tmp_path: Path) -> None:
    oiio = pytest.importorskip("OpenImageIO")
    seen = 0
    for name, true in truth(NUMBER).items():
        (path,) = (out / name).glob(f"*.{NUMBER}.*")
        oiio.ImageBuf(np.ascontiguousarray(true, np.float32)).write(str(tmp_path / "true.exr"), "float")
        within = SINGLE if name in ("depth", "position") else CODE if "png16" in name else HALF
        said = tool("idiff", "-fail", f"{within:g}", "-warn", f"{within:g}", tmp_path / "true.exr", path)
        assert "PASS" in said
        seen += 1
    assert seen + 1 == len(list(out.rglob(f"*.{NUMBER}.*"))), "all there is, and the bundle"


def test_openimageio_finds_a_part_for_every_quantity_in_a_bundle(out: Path) -> None:
    bundle = out / f"ball.{NUMBER}.exr"
    said = tool("oiiotool", "--info", "-v", "-a", bundle)
    parts = [line.split('"')[1] for line in said.splitlines() if line.strip().startswith("oiio:subimagename")]
    assert set(parts) == {path.parent.name for path in out.rglob(f"*/*.{NUMBER}.exr")}
    for place, name in enumerate(parts):
        (alone,) = (out / name).glob(f"*.{NUMBER}.exr")
        matte = ("--ch", "R,G,B") if name == "beauty" else ()  # which it has in a bundle only
        assert "PASS" in tool("oiiotool", bundle, "--subimage", str(place), *matte, alone, "--diff")
    assert parts[0] == "beauty" if "beauty" in parts else parts[0] == "normals"


def test_openimageio_reads_rate_colour_space_and_conventions(out: Path) -> None:
    said = tool("oiiotool", "--info", "-v", out / "normals" / "ball_normals.1001.exr")
    for words in ('oiio:ColorSpace: "data"', "framesPerSecond: 24000/1001", 'psvideo:y: "up"', 'compression: "zip"'):
        assert words in said
    said = tool("oiiotool", "--info", "-v", out / "albedo" / "ball_albedo.1001.exr")
    assert 'oiio:ColorSpace: "lin_rec709_scene"' in said
    said = tool("oiiotool", "--info", "-v", out / "normals_png16" / "ball_normals.1001.png")
    for words in ("uint16", "CICP: 1, 8, 0, 1", 'oiio:ColorSpace: "lin_rec709_scene"', 'psvideo:space: "camera"'):
        assert words in said


def test_a_png_without_its_tags_is_bent_where_colours_are_managed_and_with_them_it_is_not(
    out: Path, tmp_path: Path
) -> None:
    tagged = out / "normals_png16" / "ball_normals.1001.png"
    bare = tmp_path / "bare.png"
    cv2.imwrite(str(bare), read_picture(tagged, cv2.IMREAD_UNCHANGED))
    true = ball(1001)[0]

    def managed(path: Path) -> np.ndarray:
        """Return the normals of a picture that is brought to the linear working space on reading."""
        linear = tmp_path / "linear.tif"
        tool("oiiotool", "--autocc", path, "-d", "float", "--tocolorspace", "lin_rec709_scene", "-o", linear)
        read = read_picture(linear, cv2.IMREAD_UNCHANGED)[..., ::-1]
        assert read.dtype == np.float32
        return np.asarray(2 * read - 1)

    assert np.abs(managed(tagged) - true).max() < 4e-5
    assert np.abs(managed(bare) - true).max() > 0.4, "taken for sRGB"


def test_ffmpeg_reads_signed_normals_from_exr_and_codes_from_png(out: Path) -> None:
    for number in NUMBERS:
        true = ball(number)[0]
        first = {
            "normals": (f"normals/ball_normals.{number}.exr", "gbrpf16le"),
            "beauty": (f"ball.{number}.exr", "gbrapf16le"),
        }
        for name, (path, planar) in first.items():
            with av.open(str(out / path)) as container:
                frame = next(container.decode(video=0))
            assert frame.format.name == planar
            planes = [np.frombuffer(bytes(plane), np.float16).reshape(SIZE, -1)[:, :SIZE] for plane in frame.planes]
            read = np.stack([planes[2], planes[0], planes[1]], axis=-1).astype(np.float32)
            assert np.abs(read - truth(number)[name]).max() < HALF
        with av.open(str(out / "normals_png16" / f"ball_normals.{number}.png")) as container:
            frame = next(container.decode(video=0))
        assert np.array_equal(frame.to_ndarray(), encode_normals(true))
        assert int(frame.color_trc) == 8, "linear (ITU-T H.273), as the file says"


def test_three_js_reads_signed_normals_from_exr(out: Path, tmp_path: Path) -> None:
    node = shutil.which("node")
    if node is None or not (CLIENTS / "node_modules" / "three").is_dir():
        pytest.skip("needs node and three.js: tests/install.sh installs three.js where npm is there")
    for name, path in (("normals", out / "normals" / "ball_normals.1002.exr"), ("beauty", out / "ball.1002.exr")):
        raw = tmp_path / "raw"
        words: list[str | Path] = [node, CLIENTS / "read_exr.mjs", path, raw]
        said = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
        assert (said["width"], said["height"]) == (SIZE, SIZE)
        read = np.frombuffer(raw.read_bytes(), np.float32).reshape(SIZE, SIZE, 4)[::-1, :, :3]  # rows from the bottom
        assert np.abs(read - truth(1002)[name]).max() < HALF


TEXTURE = """async ([data, convert]) => {
    const image = new Image();
    image.src = "data:image/png;base64," + data;
    await image.decode();
    const gl = new OffscreenCanvas(1, 1).getContext("webgl2");
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    if (!convert) gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, image);
    const bound = gl.getParameter(gl.TEXTURE_BINDING_2D);
    gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, bound, 0);
    const read = new Uint8Array(image.width * image.height * 4);
    gl.readPixels(0, 0, image.width, image.height, gl.RGBA, gl.UNSIGNED_BYTE, read);
    return Array.from(read);
}"""


VIDEO = """async ([data, at]) => {
    const video = document.createElement("video");
    video.muted = true;
    video.src = "data:video/mp4;base64," + data;
    await new Promise((done, fail) => {
        video.onloadeddata = done;
        video.onerror = () => fail(video.error.message);
    });
    const shown = new Promise((done) => video.requestVideoFrameCallback(done));
    video.currentTime = at;
    await shown;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [video.videoWidth, video.videoHeight];
    const context = canvas.getContext("2d");
    context.drawImage(video, 0, 0);
    return [video.duration, canvas.width, Array.from(context.getImageData(0, 0, canvas.width, canvas.height).data)];
}"""


@pytest.fixture(scope="module")
def page(playwright: Any, chromium: str) -> Iterator[Any]:
    """A page in a real browser."""
    words = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    browser = playwright.chromium.launch(executable_path=chromium, args=words)
    yield browser.new_page()
    browser.close()


def text_of(path: Path) -> str:
    return base64.b64encode(path.read_bytes()).decode()


def test_a_browser_hands_a_png_of_normals_to_webgl_as_it_is_where_conversion_is_off(out: Path, page: Any) -> None:
    data = text_of(out / "normals_png16" / f"ball_normals.{NUMBER}.png")
    read = [np.array(page.evaluate(TEXTURE, [data, convert])) for convert in (False, True)]
    raw, converted = (values.reshape(SIZE, SIZE, 4)[..., :3] / 255 * 2 - 1 for values in read)
    assert np.abs(raw - ball(NUMBER)[0]).max() < 2 / 255, "browsers keep 8 bits"
    assert np.abs(converted - ball(NUMBER)[0]).max() > 0.4


def test_a_browser_plays_a_preview_in_its_colours(page: Any, tmp_path: Path) -> None:
    colours = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [128, 128, 255], [0, 0, 0], [200, 90, 30]], np.uint8)
    picture = np.repeat(np.repeat(colours[None], 32, axis=0), 32, axis=1)
    write_movie(tmp_path / "a.mp4", [picture] * 12, fps=Fraction(24), codec="vp9")
    length_s, width, pixels = page.evaluate(VIDEO, [text_of(tmp_path / "a.mp4"), 0.25])
    assert length_s == pytest.approx(0.5)
    shown = np.array(pixels).reshape(32, width, 4)[16, 16::32, :3]
    assert np.abs(shown - colours.astype(int)).max() <= 16
