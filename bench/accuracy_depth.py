"""Depth from true normals against laser scans: mean absolute error after the best scale, and the time it takes.

Published: what Cao et al. print beside their program for the same normals (2022; perspective, k = 2, scale by the
median ratio); before is what least squares without jumps give. Without the real captures only times are measured.
"""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from bench.accuracy_measure import read_image
from psvideo.solve.depth import Integration, View, depth_of_height, integrate
from psvideo.solve.depth.cao2022 import BILATERAL, SMOOTH

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "diligent_gt"
PUBLISHED_MM = {"cat": 0.074, "bear": 0.334, "pot2": 0.220}
FRAME = 1080, 1920


class DepthRow(NamedTuple):
    """One subject: as smooth least squares have it, the remedy with its time, and the result with jumps kept."""

    what: str
    before: str
    remedy: str
    after: str
    bar: str
    met: bool | None


def rows() -> Iterator[DepthRow]:
    """Integrate the three scanned objects, then smooth frames of 1080p: whole, and cut to a disc."""
    for name, published_mm in PUBLISHED_MM.items() if DATA.is_dir() else ():
        smooth_mm, _ = _object(name, SMOOTH)
        error_mm, took_s = _object(name, BILATERAL)
        bar = f"<= {1.15 * published_mm:.3f} mm (published {published_mm:.3f} mm)"
        met = error_mm <= 1.15 * published_mm
        yield DepthRow(name, f"{smooth_mm:.3f} mm", f"bilateral, {took_s:.1f} s", f"{error_mm:.3f} mm", bar, met)
    for what, mask in (("1080p, a whole frame", np.ones(FRAME, np.bool_)), ("1080p, a disc", _disc())):
        normals, height = _hills()
        (smooth_px, smooth_s), (error_px, took_s) = (_hill(normals, height, mask, how) for how in (SMOOTH, BILATERAL))
        before, remedy = f"{smooth_px:.3f} px, {smooth_s:.1f} s", f"bilateral, {took_s:.1f} s"
        yield DepthRow(what, before, remedy, f"{error_px:.3f} px", "", None)


def _object(name: str, how: Integration) -> tuple[float, float]:
    """Mean absolute depth error in mm, and seconds."""
    codes = read_image(DATA / name / "normal_map.png", cv2.IMREAD_UNCHANGED)[..., ::-1]
    mask = read_image(DATA / name / "mask.png", cv2.IMREAD_GRAYSCALE) > 0
    k = np.loadtxt(DATA / name / "K.txt")
    true = np.load(DATA / name / "depth_gt.npz")["depth_gt"]
    view = View(focal_px=(k[0, 0], k[1, 1]), principal_px=(k[0, 2], k[1, 2]))
    began = time.perf_counter()
    found = depth_of_height(integrate(codes / 32767.5 - 1, mask, view, how=how), view)
    took_s = time.perf_counter() - began
    seen = found.valid & np.isfinite(true)
    scale = np.median(true[seen] / found.depth[seen])
    return float(np.abs(scale * found.depth - true)[seen].mean()), took_s


def _hills() -> tuple[np.ndarray, np.ndarray]:
    """Twelve round hills, and their exact normals; the height is depth in pixels."""
    rng = np.random.default_rng(0)
    r, c = np.mgrid[: FRAME[0], : FRAME[1]]
    height, across, down = np.zeros(FRAME), np.zeros(FRAME), np.zeros(FRAME)
    for _ in range(12):
        row, col, width = rng.uniform(0, FRAME[0]), rng.uniform(0, FRAME[1]), rng.uniform(60, 300)
        hill = -0.5 * width * np.exp(-((r - row) ** 2 + (c - col) ** 2) / (2 * width**2))
        height += hill
        across -= hill * (c - col) / width**2
        down -= hill * (r - row) / width**2
    normals = np.dstack([across, -down, np.ones(FRAME)])
    return normals / np.linalg.norm(normals, axis=2, keepdims=True), height


def _disc() -> np.ndarray:
    r, c = np.mgrid[: FRAME[0], : FRAME[1]]
    return np.asarray((r - 540) ** 2 + (c - 960) ** 2 < 520**2)


def _hill(normals: np.ndarray, height: np.ndarray, mask: np.ndarray, how: Integration) -> tuple[float, float]:
    """Mean absolute error in pixels after the best shift, and seconds."""
    began = time.perf_counter()
    found = integrate(normals, mask, View(), how=how).height
    took_s = time.perf_counter() - began
    wrong = (found - height)[mask]
    return float(np.abs(wrong - np.median(wrong)).mean()), took_s
