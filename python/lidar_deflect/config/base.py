"""What every configuration model shares: strictness, and the small types with their units."""

import math
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    Strict,
    ValidationInfo,
    WithJsonSchema,
)
from pydantic_core import PydanticCustomError

AXES = {
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}


class Model(BaseModel):
    """Base of all tables of the configuration: frozen, and without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def problem(key: str, message: str, *, expected: str = "", hint: str = "") -> PydanticCustomError:
    """One contradiction between keys, told in the form in which the loader passes it on.

    The key is relative to the model that complains.
    """
    context = {"text": message, "key": key, "expected": expected, "hint": hint}
    return PydanticCustomError("contradiction", "{text}", context)


def _unit_vector(value: Any) -> Any:
    """Turn ``"-x"`` or three numbers into a unit vector; a unit vector stays, to the bit."""
    if isinstance(value, str):
        named = AXES.get(value if value[:1] in "+-" else f"+{value}")
        if named is None:
            raise PydanticCustomError("axis", 'Input should be "+x", "-x", ... "-z" or a vector')
        return named
    if not _three_numbers(value):
        raise PydanticCustomError("axis", 'Input should be "+x", "-x", ... "-z" or three numbers')
    norm = math.hypot(*value)
    if not 1e-9 < norm < 1e9:
        raise PydanticCustomError("axis", "Input should be a vector that has a direction")
    scale = 1.0 if abs(norm - 1.0) < 1e-12 else norm
    return tuple(float(component) / scale for component in value)


def _three_numbers(value: Any) -> bool:
    return (
        isinstance(value, list | tuple)
        and len(value) == 3
        and all(isinstance(part, int | float) and not isinstance(part, bool) for part in value)
    )


def _resolved(value: Any, info: ValidationInfo) -> Any:
    """Take a relative path from the folder of the configuration, where there is one."""
    if isinstance(value, str):
        if not value:
            raise PydanticCustomError("path", "Input should be a path, not an empty text")
        value = Path(value).expanduser()
    folder = (info.context or {}).get("folder")
    return folder / value if folder is not None and isinstance(value, Path) else value


def _ascending(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] >= pair[1]:
        raise PydanticCustomError("range", "Input should be [low, high] with low < high")
    return pair


def _source(value: str) -> str:
    """Check ``address``, ``address:port`` (IPv6 with a port in brackets), or the topic of a bag."""
    split_source(value)
    return value


def split_source(source: str) -> tuple[str, int | None]:
    """Split a stream's name into its address in canonical form and its port, if it names one."""
    import ipaddress

    if re.fullmatch(r"(/\w+)+", source):
        return source, None

    match = re.fullmatch(r"\[(?P<v6>[^\]]+)\](?::(?P<port>\d+))?", source) or re.fullmatch(
        r"(?P<v6>[^:]+):(?P<port>\d+)", source
    )
    address, port = (match["v6"], match["port"]) if match else (source, None)
    if port is not None and not 0 < int(port) < 65536:
        raise PydanticCustomError("source", "Input should have a port from 1 to 65535")
    try:
        return str(ipaddress.ip_address(address)), None if port is None else int(port)
    except ValueError:
        text = 'Input should be an address or topic, such as "192.168.1.201" or "/lidar_1/packets"'
        raise PydanticCustomError("source", text) from None


Number = Annotated[float, Strict()]
Positive = Annotated[float, Strict(), Field(gt=0)]
NotNegative = Annotated[float, Strict(), Field(ge=0)]
Share = Annotated[float, Strict(), Field(gt=0, lt=1)]
Count = Annotated[int, Strict(), Field(ge=1)]
Flag = Annotated[bool, Strict()]
Text = Annotated[str, Strict()]
Name = Annotated[str, Strict(), Field(pattern=r"^[\w.\-]+( [\w.\-]+)*$")]
Column = Annotated[str, Strict(), Field(min_length=1)]
Point = tuple[Number, Number, Number]
Range = Annotated[tuple[Number, Number], AfterValidator(_ascending)]
Source = Annotated[str, Strict(), AfterValidator(_source)]
LengthUnit = Literal["mm", "cm", "m"]
FilePath = Annotated[
    Path,
    BeforeValidator(_resolved),
    WithJsonSchema({"type": "string", "format": "path", "minLength": 1}),
]
Direction = Annotated[
    tuple[float, float, float],
    BeforeValidator(_unit_vector),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "enum": list(AXES)},
                {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
            ]
        }
    ),
]
