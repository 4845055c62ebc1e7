"""The rig of three lights whose normals are one surface's: other strengths and exchanged lights may make such, too."""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.report.judge.rig_by_facing import faces_outwards
from psvideo.report.judgement import Judgement
from psvideo.report.observe.observed import Observed

STRONGER = 1.2
"""By so many times lamps of one kind differ easily: a tenth nearer, another driver, another lens."""

UNMEASURED = (
    " The rig gives every light the strength 1, as where nobody measured it: a mirror ball shows where lights are, and "
    "not how strong."
)


def three_lights(observed: Observed) -> Judgement:
    """Say what three lights do not show, and what strengths that are off would cost."""
    as_well = "other strengths or with two lights exchanged as well."
    if faces_outwards(observed):
        as_well = "other strengths as well. Lights are hardly exchanged: normals face outwards where the subject ends."
    found = (
        "Whether the rig is right is not known: the normals fit together as one surface's, and under three lights they "
        f"mostly do so with {as_well}"
    )
    advice = (
        "Measure the strengths on a white card (psvideo calibrate flat-field), check that lights have the same names "
        "in plan and rig, or use a fourth light, which checks the others."
    )
    points = observed.points
    if points is not None:
        degrees = turned_deg(points.vectors[:, observed.firing].mean(axis=0))
        found += f" A light that is a fifth stronger than the rig says turns normals by {degrees:.0f} degrees."
        if points.strengths_all_one:
            found += UNMEASURED
    return Judgement(subject="rig", grade="unknown", found=found, advice=advice)


def turned_deg(vectors: Doubles) -> float:
    """Return by how many degrees a normal that faces the camera is turned where one light, the worst of them, is
    STRONGER than the rig says. ``vectors``: what the rig sends, (3, 3), a light a row."""
    faces = np.array([0.0, 0.0, 1.0])
    changed = vectors @ faces * (1 + (STRONGER - 1) * np.eye(3))  # a row for each light that is stronger
    normals = np.linalg.solve(vectors, changed.T).T
    cosines = normals[:, 2] / np.linalg.norm(normals, axis=1)
    return float(np.degrees(np.arccos(cosines.min())))
