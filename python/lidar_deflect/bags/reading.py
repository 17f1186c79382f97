"""Bags being read: their lidar topics, and the messages of those in the order of time."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lidar_deflect.bags.definitions import CLOUD, CUSTOM, METADATA, PACKETS, role, store
from lidar_deflect.bags.kinds import MCAP, ROS1, kind_of
from lidar_deflect.errors import CaptureError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from rosbags.interfaces import Connection

__all__ = ["Bag", "Message", "looked_at"]

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
HINTS = {
    ROS1: "an interrupted recording is repaired by: rosbag reindex FILE",
    MCAP: "an interrupted recording is repaired by: mcap recover FILE -o REPAIRED",
}


@dataclass(frozen=True, slots=True)
class Message:
    """A message of a lidar topic; `body` is deserialised, or bytes for Livox clouds."""

    topic: str
    kind: str
    role: str
    time_ns: int
    body: Any
    is_ros1: bool


@dataclass(frozen=True)
class Bag:
    """What a look at a bag tells.

    Attributes
    ----------
    topics
        Type and role of each topic that may be a lidar's.
    others
        Names of all other topics.
    """

    path: Path
    kind: str
    size: int
    start_ns: int
    messages: int
    topics: dict[str, tuple[str, str]]
    others: tuple[str, ...]

    @property
    def has_packets(self) -> bool:
        """Whether any topic carries packets."""
        return any(role == PACKETS for _, role in self.topics.values())

    def read(
        self, roles: Sequence[str], folder: Path, stop_ns: int | None = None
    ) -> Iterator[Message | None]:
        """Give the messages with these roles; None for one that cannot be deserialised."""
        with _opened(self.path, self.kind, folder) as reader:
            wanted = [
                connection
                for connection in reader.connections
                if self.topics.get(connection.topic, ("", ""))[1] in roles
            ]
            if not wanted:
                return
            is_ros1 = self.kind == ROS1
            known = store(wanted, is_ros1=is_ros1)
            take = known.deserialize_ros1 if is_ros1 else known.deserialize_cdr
            for connection, time_ns, raw in reader.messages(wanted, stop=stop_ns):
                yield self._message(connection, time_ns, bytes(raw), take)

    def _message(
        self, connection: Connection, time_ns: int, raw: bytes, take: Any
    ) -> Message | None:
        from rosbags.serde import SerdeError

        kind, role = self.topics[connection.topic]
        try:
            whole = _decompressed(raw) if raw.startswith(ZSTD_MAGIC) else raw
            body = whole if role == CUSTOM else take(whole, kind)
        except (SerdeError, KeyError, ValueError, IndexError, AssertionError, OSError):
            return None
        return Message(connection.topic, kind, role, time_ns, body, self.kind == ROS1)


def looked_at(path: Path, folder: Path) -> Bag:
    """Look at a bag's topics.

    Raises
    ------
    CaptureError
        If it cannot be read (``capture.bag_broken``).
    """
    kind = kind_of(path) or ""
    with _opened(path, kind, folder) as reader:
        topics: dict[str, tuple[str, str]] = {}
        for connection in reader.connections:
            found = role(connection.topic, connection.msgtype)
            if found is not None and connection.msgcount:
                topics[connection.topic] = (connection.msgtype, found)
        others = {c.topic for c in reader.connections} - set(topics)
        count = sum(c.msgcount for c in reader.connections if c.topic in topics)
        return Bag(
            path,
            kind,
            path.stat().st_size,
            reader.start_time,
            count,
            topics,
            tuple(sorted(others)),
        )


@contextmanager
def _opened(path: Path, kind: str, folder: Path) -> Iterator[Any]:
    """Open a bag; its suffix does not matter."""
    from rosbags import rosbag1, rosbag2

    try:
        if kind == ROS1:
            reader: Any = rosbag1.Reader(path)
        else:
            reader = rosbag2.Reader(_with_suffix(path, ".mcap" if kind == MCAP else ".db3", folder))
        reader.open()
    except Exception as error:
        # Damaged bags make the reader stumble in every way.
        raise CaptureError(
            f"{path}: expected a {kind} in order, found: {error}",
            code="capture.bag_broken",
            hint=HINTS.get(kind, "record it again, or recover it with sqlite3 FILE .recover"),
        ) from error
    try:
        yield reader
    finally:
        reader.close()


def _with_suffix(path: Path, suffix: str, folder: Path) -> Path:
    if path.suffix == suffix:
        return path
    link = folder / f"{path.name}{suffix}"
    if not link.is_symlink():
        link.symlink_to(path.resolve())
    return link


def _decompressed(raw: bytes) -> bytes:
    import sys

    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return bytes(zstd.decompress(raw))


LIDAR_ROLES = (PACKETS, METADATA)
CLOUD_ROLES = (CLOUD, CUSTOM)
