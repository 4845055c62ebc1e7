"""The readout time from an LED's stripes: real pictures, stripes of known period, true errors, and what is refused."""

import csv
import json
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import imagecodecs
import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.calibrate.stripes.error import Pulls, standard_error
from psvideo.calibrate.stripes.led_pictures import LedPictures, in_colours, read_led_pictures
from psvideo.calibrate.stripes.readout import Led, Readout, measure_readout
from psvideo.calibrate.stripes.waveform import fit_stripes
from psvideo.capture import cameras
from psvideo.cli.app import main
from psvideo.clip.decoded import CodedPicture, Header
from psvideo.errors import PsvideoError, UsageError
from psvideo.model.arrays import Doubles

LED_HZ = 1013.0
ROWS, COLS = 400, 64
LED = Led(rate_hz=LED_HZ, tolerance_ppm=0.0)


def texture(rng: np.random.Generator, rows: int, cols: int, strength: float) -> Doubles:
    """Return a scene whose logarithm is 1/f noise."""
    frequency = np.hypot(np.fft.fftfreq(rows)[:, None], np.fft.rfftfreq(cols)[None])
    frequency[0, 0] = 1
    spectrum = (rng.normal(size=frequency.shape) + 1j * rng.normal(size=frequency.shape)) / frequency
    noise = np.fft.irfft2(spectrum, s=(rows, cols))
    scene: Doubles = np.exp(strength * noise / noise.std())
    return scene


def film(
    rng: np.random.Generator,
    *,
    rows: int = ROWS,
    cols: int = COLS,
    period: float = 40.3,
    duty: float = 0.5,
    exposure: float = 0.1,
    phase: float | None = None,
    ambient: float = 0.02,
    noise: float = 0.02,
    gamma: float = 2.2,
    level: float = 0.7,
    scene: Doubles | float = 1.0,
) -> NDArray[np.uint8]:
    """Return an 8-bit picture of a blinking LED; ``period`` in rows, below 0 bottom-up; ``exposure`` in periods."""

    def light_until(blinks: Doubles) -> Doubles:
        whole = np.floor(blinks)
        return whole * duty + np.minimum(blinks - whole, duty)

    start = np.arange(rows) / period + (rng.uniform() if phase is None else phase)
    seen = (light_until(start + exposure) - light_until(start)) / min(duty, exposure)
    across, down = np.meshgrid(np.linspace(-1, 1, cols), np.linspace(-1, 1, rows))
    light = level * (1 - 0.15 * (across**2 + down**2)) * scene * (ambient + seen[:, None])
    light = light + noise * np.sqrt(np.maximum(light, 0.01)) * rng.normal(size=light.shape)
    return np.rint(255 * np.clip(light, 0, 1) ** (1 / gamma)).astype(np.uint8)


def pictures_of(frames: Sequence[NDArray[Any]]) -> LedPictures:
    """Return frames as the profiles of eight blocks of columns."""
    profiles = np.array([[np.stack([b.mean(axis=1) for b in np.array_split(f, 8, axis=1)])] for f in frames])
    places = tuple(range(len(frames))) if len(frames) > 1 else None
    return LedPictures(name="test", profiles=profiles, width_px=frames[0].shape[1], places=places)


def measured(*frames: NDArray[Any], **options: Any) -> Readout:
    return measure_readout(pictures_of(frames), LED, **options)


def clip(rng: np.random.Generator, count: int, *, fps: Fraction, **options: Any) -> list[NDArray[np.uint8]]:
    """Return consecutive frames: the LED blinks on between them."""
    first = rng.uniform()
    return [film(rng, phase=(first + n * LED_HZ / float(fps)) % 1, **options) for n in range(count)]


@pytest.mark.parametrize(
    ("file", "share"),
    [
        ("nikon1j1_1080p30_led1000hz.png", 0.001),
        # 412 rows for 10 periods, read off by hand to a row or two: 0.5 %. The picture's own period is 41.41 rows.
        ("01_50S_LED_Raw_Uncompressed.jpg", 0.0055),
        ("Z6_14bit_NEF.jpg", 0.005),
    ],
)
def test_real_pictures_give_the_published_readout(shared_data: Path, file: str, share: float) -> None:
    with (shared_data / "rs_led" / "measurements.csv").open(encoding="utf-8") as table:
        row = next(row for row in csv.DictReader(table) if row["file"] == file)
    first, end = (int(column) for column in row["clean_columns"].split("-"))
    found = measure_readout(
        read_led_pictures([shared_data / "rs_led" / file], columns=(first, end)),
        Led(rate_hz=float(row["led_hz"]), tolerance_ppm=100.0),
        rows=int(row["full_frame_rows"]),
        zoom=float(row["view_zoom"]),
    )
    assert found.readout_s * 1e3 == pytest.approx(float(row["documented_readout_ms"]), rel=share)
    assert found.rows_per_period == pytest.approx(float(row["check_period_rows"]), rel=3e-4)
    assert found.error_s < 5e-4 * found.readout_s


def test_a_mains_lamp_s_own_ripple_is_measured_and_its_faster_flicker_is_said(shared_data: Path) -> None:
    pictures = read_led_pictures([shared_data / "rs_led" / "Z6_1920Hz_PWM.jpg"], columns=(0, 85))
    found = measure_readout(pictures, Led(rate_hz=120.0, tolerance_ppm=100.0))
    assert found.readout_s == pytest.approx(0.0507, abs=0.0003)
    assert any("fainter stripes" in warning for warning in found.warnings)


@pytest.mark.parametrize("scene", ["uw_psm/horse/horse.1.png", "uw_psm/chrome/chrome.5.png", "diligent_ball/001.png"])
def test_no_readout_is_read_into_a_scene(shared_data: Path, scene: str) -> None:
    with pytest.raises(PsvideoError, match=r"stripes"):
        measure_readout(read_led_pictures([shared_data / scene]), LED)


@pytest.mark.parametrize(
    "kind",
    [
        {},
        {"period": 3.3},
        {"period": 4.7},
        {"period": 6.3},
        {"period": 171.0},
        {"rows": 150, "period": 61.0},
        {"duty": 0.05, "exposure": 0.05},
        {"duty": 0.1, "exposure": 0.02},
        {"duty": 0.03, "exposure": 0.03},
        {"duty": 0.8},
        {"exposure": 0.9},
        {"exposure": 1.4},
        {"gamma": 1.0, "level": 1.5},
        {"noise": 0.5},
        {"ambient": 1.0},
    ],
    ids=str,
)
@pytest.mark.campaign
def test_the_period_is_found_for_any_duty_exposure_curve_and_noise(kind: dict[str, float]) -> None:
    rng = np.random.default_rng(5)
    options: dict[str, Any] = {"rows": ROWS, "period": 40.3, **kind}
    found = measured(film(rng, **options))
    true_s = options["rows"] / options["period"] / LED_HZ
    assert abs(found.readout_s - true_s) < 4 * found.error_s
    assert found.error_s < 0.004 * true_s
    assert found.readout_s == pytest.approx(true_s, rel=0.0015)


@pytest.mark.campaign
def test_claimed_errors_are_the_errors_that_are_made() -> None:
    off = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        period = rng.uniform(30, 60)
        pictures = pictures_of([film(rng, period=period, scene=texture(rng, ROWS, COLS, 0.7))])
        found = fit_stripes(pictures.profiles[:, 0], (1 + 0.002 * rng.normal()) / period)
        off.append((found.frequency - 1 / period) / found.frequency_error)
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.5
    assert np.max(np.abs(off)) < 4


def test_a_textured_scene_under_daylight_cancels_where_stripes_move_over_it() -> None:
    rng = np.random.default_rng(3)
    options: dict[str, Any] = {"ambient": 1.0, "scene": texture(rng, ROWS, COLS, 1.0), "fps": Fraction(60)}
    found = measured(*clip(rng, 5, **options))
    assert found.rows_per_period == pytest.approx(40.3, rel=5e-4)
    assert abs(found.rows_per_period - 40.3) < 4 * found.rows_per_period_error


def test_frames_whose_stripes_stand_still_are_measured_as_they_are() -> None:
    rng = np.random.default_rng(4)
    found = measured(*(film(rng, phase=0.3) for _ in range(4)))
    assert found.rows_per_period == pytest.approx(40.3, rel=5e-4)
    assert found.frames == 4
    assert found.spread_s is not None


@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1 / 255, 0.0), (257.0, 64.0)])
def test_the_scale_of_code_values_does_not_matter(scale: float, offset: float) -> None:
    frame = film(np.random.default_rng(6)).astype(np.float64)
    found = measured(frame * scale + offset)
    assert found.rows_per_period == pytest.approx(measured(frame).rows_per_period, rel=1e-7)


def test_crops_and_zoomed_views_count_rows_of_the_sensor() -> None:
    frame = film(np.random.default_rng(7))
    whole = measured(frame)
    assert measured(frame, rows=2 * ROWS).readout_s == pytest.approx(2 * whole.readout_s)
    zoomed = measured(frame, zoom=2.0)
    assert zoomed.readout_s == pytest.approx(whole.readout_s)
    assert zoomed.rows == ROWS // 2
    assert measured(frame, zoom=0.5, rows=2 * ROWS).readout_s == pytest.approx(whole.readout_s)
    with pytest.raises(UsageError, match=f"`rows` {ROWS - 1}: .* shows {ROWS} rows of the sensor already"):
        measured(frame, rows=ROWS - 1)


def test_the_led_s_clock_has_its_part_in_the_error() -> None:
    pictures = pictures_of([film(np.random.default_rng(8))])
    found = measure_readout(pictures, Led(rate_hz=LED_HZ, tolerance_ppm=5000.0))
    assert found.clock_error_s == pytest.approx(found.readout_s * 5e-3 / 3**0.5)
    assert found.error_s == pytest.approx(np.hypot(found.clock_error_s, found.stripes_error_s))


def unlit(rng: np.random.Generator) -> Doubles:
    return 100 + rng.normal(size=(300, 64))


def one_and_a_half(rng: np.random.Generator) -> NDArray[np.uint8]:
    return film(rng, rows=90, period=60.0)


def uneven_pairs(rng: np.random.Generator) -> Doubles:
    return film(rng, period=30.0, phase=0.1) + 0.35 * film(rng, period=60.0, phase=0.4)


def two_lamps(rng: np.random.Generator) -> Doubles:
    return film(rng, period=30.0) + 0.9 * film(rng, period=47.1)


@pytest.mark.parametrize(
    ("picture", "words"),
    [
        (unlit, "no stripes"),
        (one_and_a_half, r"1\.5 periods"),
        (uneven_pairs, "two ways"),
        (two_lamps, "stripes"),
        (lambda rng: film(rng, exposure=1.0, scene=texture(rng, ROWS, COLS, 0.5)), "stripes"),
        (lambda rng: np.zeros((200, 64)), "no stripes"),
        (lambda rng: film(rng, rows=540, period=171.0, duty=0.03, exposure=0.02), "stripes"),
        (lambda rng: film(rng, rows=6), "stripes"),
    ],
)
def test_what_cannot_be_read_is_refused(picture: Callable[[np.random.Generator], NDArray[Any]], words: str) -> None:
    with pytest.raises(PsvideoError, match=f"test: .*{words}"):
        measured(picture(np.random.default_rng(9)))


def test_what_the_user_expects_decides_between_two_readings() -> None:
    frame = uneven_pairs(np.random.default_rng(9))
    for period in (30.0, 60.0):
        true_s = ROWS / period / LED_HZ
        assert measured(frame, near_s=1.1 * true_s).readout_s == pytest.approx(true_s, rel=0.002)


def test_a_picture_whose_halves_disagree_says_so_and_is_less_sure() -> None:
    rng = np.random.default_rng(10)
    halves = [film(rng, rows=400, period=period, phase=0.0, noise=0.0) for period in (40.0, 41.0)]
    found = measured(np.vstack(halves))
    assert "upper half" in found.warnings[0]
    assert found.rows_per_period_error > 0.3


def test_a_readout_longer_than_the_frame_is_refused() -> None:
    with pytest.raises(PsvideoError, match="longer than the"):
        measured(film(np.random.default_rng(11)), fps=Fraction(120))


@pytest.mark.parametrize(
    ("fps", "period", "direction", "reason"),
    [
        (Fraction(60), 40.3, "top-down", "step by"),
        (Fraction(60), -40.3, "bottom-up", "step by"),
        (Fraction(1013, 20), 40.3, "unknown", "alike both ways"),
        pytest.param(Fraction(2026, 33), 40.3, "unknown", "alike both ways", marks=pytest.mark.campaign),
    ],
)
def test_the_way_of_reading_shows_in_the_stripes_steps(
    fps: Fraction, period: float, direction: str, reason: str
) -> None:
    frames = clip(np.random.default_rng(12), 4, fps=fps, period=period)
    found = measured(*frames, fps=fps)
    assert (found.direction, reason in found.direction_reason) == (direction, True)


def test_a_wrong_frame_rate_shows_no_direction() -> None:
    frames = clip(np.random.default_rng(13), 4, fps=Fraction(60))
    assert "not quite what was given" in measured(*frames, fps=Fraction(59)).direction_reason
    assert "frame rate" in measured(*frames).direction_reason
    assert "three consecutive" in measured(*frames[:2], fps=Fraction(60)).direction_reason


def test_the_standard_error_of_a_sum_of_independent_pulls_and_of_alike_ones() -> None:
    rng = np.random.default_rng(14)
    rows = 4000
    reported = []
    for alike in (1, 5):
        errors = []
        for _ in range(40):
            noise = np.convolve(rng.normal(size=rows + alike - 1), np.ones(alike), "valid")
            pulls = Pulls(rows=noise, information=np.ones(rows), frames=noise[:1], groups=noise[:1])
            errors.append(standard_error(pulls, 40.0))
        reported.append(np.mean(errors))
    assert reported[0] == pytest.approx(rows**-0.5, rel=0.15)
    assert reported[1] == pytest.approx(5 * rows**-0.5, rel=0.2)


def test_the_green_of_a_mosaic_is_taken_row_by_row() -> None:
    for cfa in ("RGGB", "BGGR", "GRBG", "GBRG"):
        codes = np.empty((6, 8), np.uint16)
        for row in range(6):
            for col in range(8):
                codes[row, col] = 1000 + row if cfa[2 * (row % 2) + col % 2] == "G" else 0
        header = Header(width_px=8, height_px=6, channels=1, bits=16, cfa=cfa)
        green = in_colours(CodedPicture(header=header, codes=codes))
        assert (green[..., 0] == 1000 + np.arange(6)[:, None]).all()


@pytest.fixture(scope="module")
def led_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("led")
    for number, frame in enumerate(clip(np.random.default_rng(15), 4, fps=Fraction(60), rows=320, cols=64)):
        data = imagecodecs.png_encode(np.repeat(frame[:, :, None], 3, axis=2))
        (folder / f"led.{number:04}.png").write_bytes(data)
    return folder


def test_the_command_measures_a_folder_and_prints_lines_that_the_table_takes(
    led_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--led-hz", "1013", "--fps", "60", "--make", "Acme", "--model", "X, 2", "--mode", "HD 60p", "--json"]
    assert main(["calibrate", "readout", str(led_folder), *words]) == 0
    result = json.loads(capsys.readouterr().out)
    true_s = 320 / 40.3 / LED_HZ
    assert result["readout_s"] == pytest.approx(true_s, rel=1e-3)
    assert result["direction"] == "top-down"
    header = "make,model,mode,width_px,height_px,fps,readout_ms,direction,sure,source"
    mode = cameras._mode(next(csv.DictReader([header, result["camera_line"]])))
    assert (mode.name, mode.width_px, mode.height_px, mode.fps) == ("Acme X, 2", 64, 320, Fraction(60))
    assert mode.readout_s == pytest.approx(true_s, rel=1e-3)
    records = Path(__file__).resolve().parents[1] / "calibration" / "records" / "readout.csv"
    columns = records.read_text(encoding="utf-8").splitlines()[0].split(",")
    assert len(next(csv.reader([result["record_line"]]))) == len(columns)


def test_single_files_and_a_movie_are_measured_too(
    led_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    movie = tmp_path / "led.mp4"
    with av.open(str(movie), "w") as container:
        stream: Any = container.add_stream("mpeg4", rate=60, options={"threads": "1"})
        stream.width, stream.height, stream.pix_fmt, stream.bit_rate = 64, 320, "yuv420p", 4_000_000
        for file in sorted(led_folder.iterdir()):
            frame = av.VideoFrame.from_ndarray(imagecodecs.png_decode(file.read_bytes()), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    files = [str(file) for file in sorted(led_folder.iterdir())]
    for paths, direction in (([str(movie)], "top-down"), (files, "unknown")):
        assert main(["calibrate", "readout", *paths, "--led-hz", "1013", "--json"]) == 0
        result = json.loads(capsys.readouterr().out)
        assert result["rows_per_period"] == pytest.approx(40.3, rel=2e-3)
        assert result["direction"] == direction
    assert main(["calibrate", "readout", str(movie), "--led-hz", "1013"]) == 0
    said = capsys.readouterr().out
    assert "top row is read first" in said
    assert "MAKE,MODEL,MODE,64,320,60," in said


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["nowhere.png"], 1, "nowhere.png: is not there"),
        (["notes.txt"], 1, "is not a picture"),
        (["."], 1, "notes.txt|images"),
        (["grey.png", "wide.png"], 1, "wide.png: is 40 x 32"),
        (["grey.png"], 1, "grey.png: holds no stripes"),
        (["grey.png", "--columns", "0-99"], 2, "has columns 0-32 only"),
        (["grey.png", "--columns", "8"], 2, "--columns '8'"),
        (["grey.png", "--near", "16"], 2, "--near '16'"),
        (["grey.png", "--frames", "1-3"], 2, "--frames"),
        (["broken.png"], 1, "broken.png"),
    ],
)
def test_bad_input_is_one_paragraph(
    arguments: list[str],
    status: int,
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("notes.txt").write_text("no picture", encoding="utf-8")
    Path("grey.png").write_bytes(imagecodecs.png_encode(np.full((32, 32), 90, np.uint8)))
    Path("wide.png").write_bytes(imagecodecs.png_encode(np.full((32, 40), 90, np.uint8)))
    Path("broken.png").write_bytes(Path("grey.png").read_bytes()[:40])
    assert main(["calibrate", "readout", *arguments, "--led-hz", "500"]) == status
    said = capsys.readouterr().err
    assert any(word in said for word in words.split("|"))
    assert len(said.strip().splitlines()) == 1
