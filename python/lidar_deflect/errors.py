"""What can go wrong, as one tree: each error has a stable code, facts and a next step."""

from collections.abc import Sequence


class LidarDeflectError(Exception):
    """Base of all errors of lidar-deflect.

    Parameters
    ----------
    message
        What went wrong, with place, expected and found.
    code
        Stable name of the kind of failure, such as ``capture.no_lidar``.
    facts
        Pairs of a word and a line, printed beneath the message.
    hint
        One next step.
    """

    default_code = "error"
    exit_code = 1

    def __init__(
        self,
        message: str,
        *,
        code: str | None = None,
        facts: Sequence[tuple[str, str]] = (),
        hint: str | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.code = code or self.default_code
        self.facts = tuple(facts)
        self.hint = hint

    def __str__(self) -> str:
        return self.message


class InvalidValueError(LidarDeflectError, ValueError):
    """An argument outside of what its meaning allows."""

    default_code = "value.invalid"
    exit_code = 2


class CaptureError(LidarDeflectError, ValueError):
    """A capture that is missing, unreadable or holds no known lidar."""

    default_code = "capture"
    exit_code = 3


class CaptureNotFoundError(CaptureError, FileNotFoundError):
    """A capture that is not there."""

    default_code = "capture.not_found"


class PacketError(CaptureError):
    """A packet that is not what its sensor sends."""

    default_code = "packet"


class ConfigError(LidarDeflectError, ValueError):
    """A configuration that cannot be meant."""

    default_code = "config"
    exit_code = 4


class ConfigNotFoundError(ConfigError, FileNotFoundError):
    """A configuration, or a file it names, that is not there."""

    default_code = "config.not_found"


class CalibrationError(LidarDeflectError):
    """Poses that the data do not fix."""

    default_code = "calibration"
    exit_code = 5


class MeasurementError(LidarDeflectError):
    """A measurement that the data do not allow."""

    default_code = "measurement"
    exit_code = 5


class ResultError(LidarDeflectError, ValueError):
    """A result folder, table or reference that cannot be used."""

    default_code = "result"
    exit_code = 3


class ResultNotFoundError(ResultError, FileNotFoundError):
    """A result folder, table or reference that is not there."""

    default_code = "result.not_found"


class OutputError(LidarDeflectError, OSError):
    """A result that cannot be written."""

    default_code = "output"
    exit_code = 7


class MissingExtraError(LidarDeflectError, ImportError):
    """An optional part that is not installed."""

    default_code = "environment.missing_extra"
    exit_code = 7
