"""Two lights of a rig that are taken for each other are named, and other faults are not called an exchange."""

import numpy as np
import pytest

from psvideo.model.surface import Misfit
from psvideo.report.judge.of_accuracy import accuracy
from psvideo.report.judge.of_rig import rig as judge_rig
from psvideo.report.judge.rig_by_plates import lights_exchanged
from psvideo.report.judge.typical_error import MEAN_OF_HELD
from psvideo.report.observe.alignment.astray import Astray
from psvideo.report.observe.close_looks import CloseLooks
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigfit import RigFit, rig_fit


def ways(lights: int) -> np.ndarray:
    """Return directions around the camera, at two heights in turn."""
    around = np.arange(lights) * 2 * np.pi / lights
    slant = np.radians(np.where(np.arange(lights) % 2, 30.0, 50.0))
    return np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), np.cos(slant)], axis=-1)


def fit_of(rig: np.ndarray, *, seed: int, sheen: float = 0.1) -> RigFit:
    """Return what points of a bumpy surface with some sheen, under ``ways``, say of a rig."""
    rng, true = np.random.default_rng(seed), ways(len(rig))
    normals = np.concatenate([rng.normal(size=(3000, 2)) * 0.35, np.ones((3000, 1))], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    halves = true + np.array([0, 0, 1])
    halves /= np.linalg.norm(halves, axis=1, keepdims=True)
    light = rng.uniform(0.2, 0.7, (3000, 1)) * np.maximum(normals @ true.T, 0)
    light += sheen * np.maximum(normals @ halves.T, 0) ** 20 + 0.003 * rng.normal(size=light.shape)
    fit = rig_fit(np.clip(light, 0, 1), rig[None], rng.uniform(-0.5, 0.5, (3000, 2)))
    assert fit is not None
    return fit


@pytest.mark.parametrize("lights", [8, 12])
@pytest.mark.parametrize("seed", range(4))
def test_two_exchanged_lights_are_named(lights: int, seed: int) -> None:
    one, other = np.sort(np.random.default_rng(seed).choice(lights, 2, replace=False))
    rig = ways(lights)
    rig[[one, other]] = rig[[other, one]]
    fit = fit_of(rig, seed=seed)
    assert fit.exchanged == (one, other)
    said = lights_exchanged([f"lamp {n}" for n in range(lights)], fit)
    assert said is not None
    assert said.grade in ("doubtful", "bad")
    assert f"'lamp {one}' and 'lamp {other}' are exchanged" in said.found


@pytest.mark.parametrize("lights", [6, 8, 12])
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in (1, 2, 3))])
def test_other_faults_of_a_rig_are_no_exchange(lights: int, seed: int) -> None:
    right = ways(lights)
    off = right + 0.12 * np.random.default_rng(50 + seed).normal(size=right.shape)
    weak = right * np.where(np.arange(lights) == seed, 0.6, 1.0)[:, None]
    for rig in (right, right * [-1, 1, 1], np.roll(right, 1, axis=0), off, weak):
        for sheen in (0.0, 0.5):
            fit = fit_of(rig, seed=seed, sheen=sheen)
            assert fit.exchanged is None
            assert lights_exchanged([f"lamp {n}" for n in range(lights)], fit) is None


def test_five_lights_do_not_tell_an_exchange() -> None:
    assert fit_of(ways(5)[[1, 0, 2, 3, 4]], seed=0).exchanged is None


NAMES = tuple(f"lamp {n}" for n in range(8))
MOVED = Astray(
    typical_px=2.0, error_px=0.1, shift_px=2.0, turn_deg=0.0, zoom=0.0, radius_px=50.0, light="lamp 0", most_px=3.0,
    agreement=0.9, light_that_fits_least="lamp 0", shows=True,
)  # fmt: skip


def observed_of(fit: RigFit, monkeypatch: pytest.MonkeyPatch, *, astray: list[Astray]) -> Observed:
    """Return what a take would show whose rig fit is known, and whose normals are 6 degrees off."""
    monkeypatch.setattr(Observed, "rig_fit", fit)
    monkeypatch.setattr(Observed, "firing_lights", NAMES)
    misfit = Misfit(share=0.1, error_deg=6.0 / MEAN_OF_HELD)
    facts = InstantFacts(number=1, time_s=0.0, valid_share=0.9, clipped_share=0.0, unseen_share=0.0, misfit=misfit)
    return Observed(lights=NAMES, facts=KeptFacts([facts]), closely=CloseLooks(astray=astray))


def test_a_rig_that_does_not_fit_is_not_known_to_be_wrong_where_pictures_are_not_aligned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shifted = fit_of(np.roll(ways(8), 1, axis=0), seed=0)
    moved, stood = (list(judge_rig(observed_of(shifted, monkeypatch, astray=one))) for one in ([MOVED], []))
    assert [(line.subject, line.grade) for line in moved] == [("rig", "unknown")]
    assert "See the line on motion" in moved[0].found
    assert stood[0].grade in ("doubtful", "bad")


def test_what_normals_are_off_by_is_laid_to_the_exchange(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = ways(8)
    rig[[2, 5]] = rig[[5, 2]]
    seen = observed_of(fit_of(rig, seed=0), monkeypatch, astray=[])
    assert [line.found for line in accuracy(seen)] == [
        "Beyond noise, a typical normal is off by about 6 degrees: two lights are exchanged."
    ]
    assert "'lamp 2' and 'lamp 5' are exchanged" in next(judge_rig(seen)).found
