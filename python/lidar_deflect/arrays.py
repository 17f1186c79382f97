"""Arrays as the compiled core takes them: (n, 3) or (n,), C order, few dtypes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.errors import InvalidValueError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Cloud = NDArray[np.float32] | NDArray[np.float64]


def cloud(name: str, values: ArrayLike) -> Cloud:
    """Points as an (n, 3) array of float32 or float64 in C order, copied only where needed.

    Parameters
    ----------
    name
        Name of the argument, for the message.
    values
        Points, shape (n, 3); float32 stays float32, other real numbers become float64.

    Raises
    ------
    TypeError
        If the values are not real numbers.
    InvalidValueError
        If the shape is not (n, 3).
    """
    array = _real(name, values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidValueError(f"{name}: expected shape (n, 3), found shape {array.shape}")
    if array.dtype == np.float32:
        return np.ascontiguousarray(array, dtype=np.float32)
    return np.ascontiguousarray(array, dtype=np.float64)


def column(name: str, values: ArrayLike, length: int | None = None) -> NDArray[np.float64]:
    """Numbers as an (n,) array of float64, n = `length` where one is given.

    Raises
    ------
    TypeError
        If the values are not real numbers.
    InvalidValueError
        If there is more than one axis or the length differs.
    """
    array = _real(name, values)
    if array.ndim != 1 or length not in (None, len(array)):
        expected = "(n,)" if length is None else f"({length},)"
        raise InvalidValueError(f"{name}: expected shape {expected}, found shape {array.shape}")
    return np.ascontiguousarray(array, dtype=np.float64)


def vector(name: str, values: ArrayLike) -> tuple[float, float, float]:
    """Three finite numbers.

    Raises
    ------
    InvalidValueError
        If there are not three or one is not finite.
    """
    array = column(name, values, 3)
    if not np.isfinite(array).all():
        raise InvalidValueError(f"{name}: expected finite numbers, found {array.tolist()}")
    x, y, z = array.tolist()
    return x, y, z


def _real(name: str, values: ArrayLike) -> NDArray[Any]:
    array = np.asarray(values)
    if array.size and array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected real numbers, found dtype {array.dtype}")
    return array
