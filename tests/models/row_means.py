"""Row means of a clip as the fit takes them."""

import numpy as np
from numpy.typing import NDArray

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.profiles import Profiles


def rows_of(plan: Plan, profiles: NDArray[np.float64]) -> Profiles:
    """Return row profiles (frame, row) as rows of one window."""
    frames, height = profiles.shape
    return Profiles(
        value=profiles,
        index=np.arange(frames),
        period_s=plan.camera.frame_period_s,
        place=np.arange(float(height)),
        window_start=np.zeros(1, np.int64),
    )
