"""Equation (16) of the paper."""

import numpy as np
import numpy.typing as npt

NEGLIGIBLE = 0.01
"""A reference below this share of the largest one is too near to zero for a relative error."""


def error_percent(measured: npt.ArrayLike, reference: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return (M - T) / T in percent, shape as given; NaN where T is 0.

    Parameters
    ----------
    measured
        M, any unit.
    reference
        T, in the unit of M.

    Notes
    -----
    Equation (16) of Hu et al., Optics 2024, 5, 151-164.
    """
    m, t = np.asarray(measured, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    return 100.0 * (m - t) / np.where(t == 0.0, np.nan, t)
