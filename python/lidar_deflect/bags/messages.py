"""Datagrams out of the messages that drivers record."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

__all__ = ["DESCRIPTION_PORT", "Datagram", "datagrams", "stamp_ns"]

NANOS_PER_SECOND = 1_000_000_000

DATA_PORT = 2368
DESCRIPTION_PORT = 7788
"""Packets that describe the unit (DIFOP) keep off the port of the data."""


@dataclass(frozen=True, slots=True)
class Datagram:
    """What a sensor sent.

    Attributes
    ----------
    stamp_ns
        When the driver says that it came, nanoseconds since 1970; None where it does not say.
    """

    payload: bytes
    stamp_ns: int | None
    port: int


def datagrams(message: Any, kind: str) -> Iterator[Datagram]:
    """Take a message of packets apart, whichever driver's it is."""
    if hasattr(message, "packets"):
        for packet in message.packets:
            yield from datagrams(packet, kind)
        return
    if hasattr(message, "packet"):  # one that describes the unit
        yield Datagram(_payload(message.packet, kind), stamp_ns(message.packet), DESCRIPTION_PORT)
        return
    is_description = bool(getattr(message, "is_difop", False))
    port = DESCRIPTION_PORT if is_description else DATA_PORT
    yield Datagram(_payload(message, kind), stamp_ns(message), port)


def stamp_ns(message: Any) -> int | None:
    """Stamp of a message or of its header; None where there is none, or zero."""
    stamp = getattr(message, "stamp", None) or getattr(
        getattr(message, "header", None), "stamp", None
    )
    if stamp is None:
        return None
    return int(stamp.sec) * NANOS_PER_SECOND + int(stamp.nanosec) or None


def _payload(packet: Any, kind: str) -> bytes:
    data = packet.buf if hasattr(packet, "buf") else packet.data
    payload = data.tobytes() if hasattr(data, "tobytes") else bytes(data)
    size = getattr(packet, "size", None)
    if size is not None:
        payload = payload[: int(size)]
    # Old drivers of Ouster store one byte too many; its packets are never of odd length.
    is_too_long = kind.endswith("PacketMsg") and len(payload) % 2 == 1
    return payload[:-1] if is_too_long else payload
