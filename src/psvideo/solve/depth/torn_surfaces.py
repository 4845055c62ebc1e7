"""Which surfaces stand apart, by near lights' falloff: no step of normals leads from one to the other, and each is
integrated by itself.

Where the distances of single places jump, the surface may be torn, or steep, or these are off. All is integrated as one
to see: pieces stay apart where one of them is explained far worse at the distance that it has in the whole than at one
of its own. So a wall is not torn by shadows on it, and a table that runs away from the camera stays whole.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Floats, Mask
from psvideo.model.surface import Distances
from psvideo.solve.depth.cao2022 import Integration, integrate
from psvideo.solve.depth.falloff_evidence import SHIFTS, DistanceEvidence, evidence_of
from psvideo.solve.depth.view import View
from psvideo.solve.pixels_of_points import for_pixels

JUMP = 0.08
"""Between neighbours, distances that differ by more than this share may be two surfaces'."""
LEAST_SHARE = 0.002
"""Share of the picture below which nothing is a surface of its own: some six squares' worth of light."""
WORSE, OFF, UNKNOWN = 1.0, 0.03, 0.5
"""A piece stands apart where its cost at the distance that it has in the whole is so much larger than at its own, as a
share of that, and the two differ by more than the second share; not where its own may be off by more than the third."""

Labels = NDArray[np.int32]


def layers_of(
    distances: Distances, normals: NDArray[np.floating], shown: Mask, view: View, how: Integration
) -> list[Mask]:
    """Return the pixels (row, col) that are ``shown`` in layers that are integrated one by one, as few as keep surfaces
    apart that touch and stand apart.

    normals: (row, col, 3), in the camera's frame. view: a pinhole's.
    """
    pieces = pieces_of(distances)
    if pieces.max() == 0:
        return [shown]
    step = distances.step * max(distances.each // 2, 1)
    thin, seen = np.ascontiguousarray(normals[::step, ::step]), np.ascontiguousarray(shown[::step, ::step])
    rough = integrate(thin, seen, view.thinned(step, shown.shape), how=how).height
    rows, cols = (
        np.minimum(np.arange(0, size, distances.each) * distances.step // step, many - 1)
        for size, many in zip(pieces.shape, rough.shape, strict=True)
    )
    focal = 1.0 if view.focal_px is None else view.focal_px[0] / step
    there = shown[:: distances.step, :: distances.step]
    surfaces = surfaces_of(pieces, there, distances, rough[np.ix_(rows, cols)] / focal)
    layer = _layers(surfaces)
    of_pixel = for_pixels(layer[surfaces], distances.step, shown.shape)
    layers = [shown & (of_pixel == number) for number in range(int(layer.max()) + 1)]
    return [one for one in layers if one.any()] or [shown]


def _layers(surfaces: Labels) -> NDArray[np.uint8]:
    """Return the layer of each surface: none that touch have the same."""
    count = int(surfaces.max()) + 1
    beside = _outlines(surfaces, count)
    layer = np.full(count, -1)
    for one in np.argsort(-np.bincount(surfaces.ravel(), minlength=count), kind="stable"):
        taken = layer[beside[one] > 0]
        layer[one] = next(free for free in range(count) if free not in taken)
    return layer.astype(np.uint8)


def pieces_of(distances: Distances) -> Labels:
    """Return the number of every point's piece, from 0 on, (row, col) as ``distances.depth_m``: what jumps of these
    enclose."""
    logs = np.log(distances.depth_m)
    torn, leak = _torn(logs), 2 * distances.each + 1
    whole = ~cv2.dilate((torn[0] | torn[1]).view(np.uint8), np.ones((leak, leak), np.uint8)).view(np.bool_)
    _, labels, facts, _ = cv2.connectedComponentsWithStats(whole.view(np.uint8), connectivity=4)
    large = facts[:, cv2.CC_STAT_AREA] >= max(LEAST_SHARE * logs.size, 1)
    large[0] = False
    if large.sum() < 2:
        return np.zeros(logs.shape, np.int32)
    number = np.where(large, np.cumsum(large), 0).astype(np.int32)
    return _grown(_grown(number[labels], torn), np.zeros_like(torn)) - 1


def surfaces_of(pieces: Labels, there: Mask, distances: Distances, logs_m: Doubles) -> Labels:
    """Return ``pieces`` (row, col) of which those are one that stand apart no more than the light tells.

    there: (row, col), where they have normals. logs_m: the logarithm of depth, were all one surface, at every point
    that ``distances`` have costs for.
    """
    labels = pieces.copy()
    told = [
        evidence_of(distances, logs_m, pure(there & (labels == one), distances.each))
        for one in range(int(pieces.max()) + 1)
    ]
    while len(told) > 1:
        beside = _outlines(labels, len(told))
        pairs = np.argwhere(np.triu(beside, 1))
        apart = [_apart(told[one], told[other]) for one, other in pairs]
        longest = [-beside[one, other] for one, other in pairs]
        best = min(range(len(pairs)), key=lambda n: (apart[n], longest[n]))
        if apart[best] > WORSE:
            break
        one, other = pairs[best]
        told[one] += told[other]
        del told[other]
        labels[labels == other] = one
        labels -= labels > other
    return labels


def _apart(one: DistanceEvidence, other: DistanceEvidence) -> float:
    """Return how much worse one of two pieces is explained where it stands beside the other in the whole."""
    if not (one.told and other.told):
        return 0.0
    place = int(np.argmin((one + other).mean))
    worse = 0.0
    for piece in (one, other):
        if abs(SHIFTS[int(np.argmin(piece.mean))] - SHIFTS[place]) > OFF and piece.unsure < UNKNOWN:
            worse = max(worse, (float(piece.mean[place]) - float(piece.mean.min())) / piece.misfit)
    return worse


def pure(part: Mask, each: int) -> Mask:
    """Return which of every ``each``-th points (row, col) of a part have nothing else around them."""
    size = each + 2
    inside = cv2.erode(part.view(np.uint8), np.ones((size, size), np.uint8))
    return np.ascontiguousarray(inside[::each, ::each]).view(np.bool_)


def _torn(logs: Floats) -> Mask:
    """Return whether the surface is torn between a point and its right, and its lower neighbour, (2, row, col)."""
    torn = np.zeros((2, *logs.shape), np.bool_)
    torn[0, :, :-1] = np.abs(np.diff(logs, axis=1)) > JUMP
    torn[1, :-1] = np.abs(np.diff(logs, axis=0)) > JUMP
    return torn


def _grown(labels: Labels, torn: Mask) -> Labels:
    """Return labels (row, col) that have grown into points of label 0, from neighbour to neighbour where nothing is
    ``torn``: a point takes that of its left, right, upper or lower neighbour, the first that has one."""
    labels, east, south = labels.copy(), ~torn[0, :, :-1], ~torn[1, :-1]
    while True:
        ways = np.zeros((4, *labels.shape), labels.dtype)
        ways[0, :, 1:], ways[1, :, :-1] = np.where(east, labels[:, :-1], 0), np.where(east, labels[:, 1:], 0)
        ways[2, 1:], ways[3, :-1] = np.where(south, labels[:-1], 0), np.where(south, labels[1:], 0)
        fresh = np.where(labels == 0, np.select(list(ways > 0), list(ways), 0), 0)
        if not fresh.any():
            return labels
        labels += fresh


def _outlines(labels: Labels, count: int) -> NDArray[np.int64]:
    """Return how long the outline is that surfaces share, in points, (one, other)."""
    every = np.zeros((count, count), np.int64)
    for one, other in ((labels[:, :-1], labels[:, 1:]), (labels[:-1], labels[1:])):
        apart = one != other
        np.add.at(every, (one[apart], other[apart]), 1)
    return every + every.T
