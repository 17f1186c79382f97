"""A swing as sine waves: frequency, phase over time, and least squares of one cycle or of many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

HARMONICS = 2
"""Sine waves that are fitted: bending far brings about the second."""
FINER = 16
"""The first guess of the frequency comes from a spectrum that is so much finer than its data."""
LEAST_CYCLES = 2.0
"""Fewer cycles than this in the data have no frequency."""
REFINEMENTS = 8


@dataclass(frozen=True)
class Wave:
    """Mean and first sine wave of several series over one stretch of time.

    ``x(t) = mean + amplitude * sin(angle(t) + phase)``, with `angle` as it was given.

    Attributes
    ----------
    mean, amplitude, phase_rad
        Shape (n,).
    u_mean, u_amplitude, u_phase_rad
        Their standard uncertainties from the scatter about the waves, shape (n,).
    """

    mean: Floats
    amplitude: Floats
    phase_rad: Floats
    u_mean: Floats
    u_amplitude: Floats
    u_phase_rad: Floats


def main_direction(xyz_m: Floats) -> Floats:
    """Return the unit vector along which points (n, 3) move most; its largest part is positive."""
    known = xyz_m[~np.isnan(xyz_m).any(axis=1)]
    _, _, axes = np.linalg.svd(known - known.mean(axis=0), full_matrices=False)
    largest = axes[0, np.argmax(np.abs(axes[0]))]
    return np.asarray(axes[0] * np.sign(largest))


def coarse_hz(time_s: Floats, value: Floats) -> float | None:
    """Frequency of the strongest wave, from a spectrum; None where there are too few cycles."""
    step = float(np.median(np.diff(time_s)))
    even = np.arange(time_s[0], time_s[-1] + step / 2, step)
    series = np.interp(even, time_s, value)
    series = (series - series.mean()) * np.hanning(len(series))
    power = np.abs(np.fft.rfft(series, FINER * len(series)))
    frequency = np.fft.rfftfreq(FINER * len(series), step)
    power[frequency * (even[-1] - even[0]) < LEAST_CYCLES] = 0.0
    best = int(np.argmax(power))
    return float(frequency[best]) if power[best] > 0.0 else None


def phase_rad(time_s: Floats, value: Floats, frequency_hz: float) -> tuple[Floats, Floats]:
    """Phase and amplitude over time, each from the period about its moment.

    The phase is unwrapped, in rad, and zero, 2 pi, ... where the wave rises through its mean.
    """
    turn = 2.0 * np.pi * frequency_hz
    found = np.full((2, len(time_s)), np.nan)
    half = 0.5 / frequency_hz
    for place, now in enumerate(time_s):
        near = np.abs(time_s - now) <= half + 1e-9
        if near.sum() < 2 * HARMONICS + 2:
            continue
        since = time_s[near] - now
        angle = turn * since
        basis = [np.ones_like(angle), since, np.sin(angle), np.cos(angle)]
        basis += [np.sin(2.0 * angle), np.cos(2.0 * angle)] if near.sum() > 8 else []
        parts = np.linalg.lstsq(np.column_stack(basis), value[near], rcond=None)[0]
        found[:, place] = np.arctan2(parts[3], parts[2]), np.hypot(parts[2], parts[3])
    known = ~np.isnan(found[0])
    expected = turn * (time_s - time_s[0])
    off = np.unwrap(found[0, known] - expected[known])
    found[0, known] = expected[known] + off
    return found[0], found[1]


def refined_hz(time_s: Floats, value: Floats, frequency_hz: float) -> tuple[float, float]:
    """Frequency and its standard uncertainty of a steady swing, by least squares with its waves."""
    middle = 0.5 * (time_s[0] + time_s[-1])
    since = time_s - middle
    spread = np.inf
    for _ in range(REFINEMENTS):
        basis = _basis(2.0 * np.pi * frequency_hz * since)
        parts = np.linalg.lstsq(basis, value, rcond=None)[0]
        sine, cosine = basis[:, 1], basis[:, 2]
        slope = 2.0 * np.pi * since * (parts[1] * cosine - parts[2] * sine)
        wide = np.column_stack([basis, slope])
        parts = np.linalg.lstsq(wide, value, rcond=None)[0]
        frequency_hz += float(parts[-1])
        spread = float(_spread(wide, value - wide @ parts)[-1])
    return frequency_hz, spread


def wave(angle_rad: Floats, values: Floats) -> Wave:
    """Fit mean and waves to series (t, n) at phases (t,).

    The standard uncertainties take neighbouring residuals as they follow each other.
    """
    basis = _basis(angle_rad)
    parts = np.linalg.lstsq(basis, values, rcond=None)[0]
    off = values - basis @ parts
    spread = np.array([_spread(basis, column) for column in off.T]).T
    amplitude = np.hypot(parts[1], parts[2])
    u_amplitude = np.hypot(spread[1], spread[2]) / np.sqrt(2.0)
    return Wave(
        mean=parts[0],
        amplitude=amplitude,
        phase_rad=np.arctan2(parts[2], parts[1]),
        u_mean=spread[0],
        u_amplitude=u_amplitude,
        u_phase_rad=np.minimum(u_amplitude / np.maximum(amplitude, 1e-12), np.pi),
    )


def _basis(angle: Floats) -> Floats:
    """Columns of the mean and of as many waves as the moments can tell apart."""
    columns = [np.ones_like(angle), np.sin(angle), np.cos(angle)]
    for harmonic in range(2, HARMONICS + 1):
        if len(angle) > 2 * harmonic + 3:
            columns += [np.sin(harmonic * angle), np.cos(harmonic * angle)]
    return np.column_stack(columns)


def _spread(basis: Floats, off: Floats) -> Floats:
    """Return standard deviations of parts, from residuals that may follow each other."""
    freedom = max(len(off) - basis.shape[1], 1)
    power = float(off @ off)
    lag = float(off[1:] @ off[:-1]) / max(power, 1e-300)
    factor = (1.0 + min(max(lag, 0.0), 0.9)) / (1.0 - min(max(lag, 0.0), 0.9))
    covariance = np.linalg.pinv(basis.T @ basis) * (power / freedom * factor)
    return np.asarray(np.sqrt(np.maximum(np.diag(covariance), 0.0)))
