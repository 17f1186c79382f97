"""From bags to temporary captures: one per bag and topic, so that each is in the order of time."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from lidar_deflect.bags.clouds import custom, point_cloud
from lidar_deflect.bags.definitions import CUSTOM, METADATA, PACKETS
from lidar_deflect.bags.messages import DESCRIPTION_PORT, datagrams
from lidar_deflect.bags.packing import PointPacker
from lidar_deflect.bags.pcap import LARGEST_BYTES, PcapFile
from lidar_deflect.bags.reading import CLOUD_ROLES, LIDAR_ROLES, Bag, Message, looked_at
from lidar_deflect.bags.topics import Topics
from lidar_deflect.errors import CaptureError, OutputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from lidar_deflect.units import UnitFile

__all__ = ["Unpacked", "looks", "unpack"]

POINTS_PORT = 2370
LATE_NS = 5_000_000_000
"""A driver's stamp is believed where the bag's own follows within so much."""
EARLY_NS = 1_000_000_000
STRIDE = 64
"""Messages between two calls of progress."""


@dataclass(frozen=True)
class Unpacked:
    """What bags held, as captures.

    Attributes
    ----------
    paths
        Temporary captures.
    topics
        Which address stands for which topic.
    units
        Descriptions of single units that were recorded along.
    captures
        Entries of the bags for ``captures`` of ``info``.
    drops
        Messages that gave nothing, by reason.
    notes
        Remarks by topic.
    """

    paths: tuple[Path, ...]
    topics: Topics
    units: tuple[UnitFile, ...]
    captures: tuple[dict[str, Any], ...]
    drops: dict[str, int]
    notes: dict[str, tuple[str, ...]]


@dataclass
class _Lane:
    """One topic of one bag on its way into a capture."""

    file: PcapFile
    packer: PointPacker = field(default_factory=PointPacker)
    is_stamped: bool | None = None
    bag_ns: int = 0

    def time_ns(self, stamp_ns: int | None, bag_ns: int) -> int:
        """Choose the driver's stamp where the first of the topic is plausible, else the bag's."""
        if self.is_stamped is None and stamp_ns is not None:
            self.is_stamped = -EARLY_NS <= bag_ns - stamp_ns <= LATE_NS
        return stamp_ns if self.is_stamped and stamp_ns is not None else bag_ns


@dataclass
class _Seen:
    """What was read of one bag."""

    count: int = 0
    times_ns: tuple[int | None, int | None] = (None, None)
    warnings: list[str] = field(default_factory=list)

    def entry(self, bag: Bag) -> dict[str, Any]:
        """Entry of ``captures`` in ``info``."""
        return {
            "path": bag.path,
            "size_bytes": bag.size,
            "format": bag.kind,
            "records": self.count,
            "first_host_ns": self.times_ns[0],
            "last_host_ns": self.times_ns[1],
            "warnings": self.warnings,
        }


def looks(paths: Sequence[Path], folder: Path) -> list[Bag]:
    """Look at bags.

    Raises
    ------
    CaptureError
        If one is broken, or none has a topic of a lidar (``capture.no_lidar``).
    """
    bags = [looked_at(path, folder) for path in paths]
    if not any(role != METADATA for bag in bags for _, role in bag.topics.values()):
        raise _no_topics(bags)
    return bags


def unpack(
    paths: Sequence[Path],
    folder: Path,
    *,
    head_s: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Unpacked:
    """Write what bags hold of lidars as captures into `folder`.

    Parameters
    ----------
    paths
        Bags.
    folder
        Where the captures go; somebody else removes it.
    head_s
        Only so much of the start of the recording.
    progress
        Called with bytes done and in total.

    Raises
    ------
    CaptureError
        If a bag is broken, or there is no lidar in them.
    OutputError
        If there is no room for the captures.
    """
    bags = looks(paths, folder)
    stop_ns = None
    if head_s is not None:
        stop_ns = min(bag.start_ns for bag in bags) + round(head_s * 1e9)
    work = _Work(bags, folder, stop_ns, progress)
    try:
        for number, bag in enumerate(bags):
            work.take(number, bag)
    except OSError as error:
        raise OutputError(
            f"{folder}: the packets of the bags cannot be unpacked: {error.strerror or error}",
            code="output.unwritable",
            hint="make room, or choose another folder by the variable TMPDIR",
        ) from error
    return work.unpacked()


class _Work:
    """What the bags have given so far."""

    def __init__(
        self,
        bags: Sequence[Bag],
        folder: Path,
        stop_ns: int | None,
        progress: Callable[[int, int], None] | None,
    ) -> None:
        self._folder, self._stop_ns, self._progress = folder, stop_ns, progress
        self._bags = bags
        self._roles = LIDAR_ROLES if any(bag.has_packets for bag in bags) else CLOUD_ROLES
        used = [
            topic
            for bag in bags
            for topic, (_, role) in bag.topics.items()
            if role in self._roles and role != METADATA
        ]
        self._topics = Topics.of(used)
        self._total = sum(bag.size for bag in bags)
        self._done = 0
        self._paths: list[Path] = []
        self._count = 0
        self._captures: list[dict[str, Any]] = []
        self._units: dict[str, UnitFile] = {}
        self._drops: dict[str, int] = {}
        self._notes: dict[str, list[str]] = {}

    def take(self, number: int, bag: Bag) -> None:
        """Unpack one bag; one that is damaged further on gives what stands before."""
        lanes: dict[str, _Lane] = {}
        seen = _Seen()
        if self._stop_ns is not None and bag.start_ns >= self._stop_ns:
            return
        with ExitStack() as files:
            for message in self._messages(bag, seen):
                self._message(message, number, lanes, files)
            for lane in lanes.values():
                for stop_ns, payload in lane.packer.finish():
                    self._point_packet(lane, stop_ns, payload)
        self._count += sum(lane.file.count for lane in lanes.values())
        self._done += bag.size
        self._tell(bag, 0)
        self._note(bag, lanes)
        self._captures.append(seen.entry(bag))

    def _messages(self, bag: Bag, seen: _Seen) -> Iterator[Message]:
        """Give the messages of a bag up to where it is damaged."""
        messages = bag.read(self._roles, self._folder, self._stop_ns)
        while True:
            try:
                message = next(messages)
            except StopIteration:
                return
            except CaptureError:
                raise
            except Exception as error:  # the reader stumbles over damage in every way
                seen.warnings.append(f"damaged after {seen.count} messages: {error}")
                return
            seen.count += 1
            if seen.count % STRIDE == 0:
                self._tell(bag, seen.count)
            if message is None:
                self._drop("message_unreadable")
            else:
                seen.times_ns = (seen.times_ns[0] or message.time_ns, message.time_ns)
                yield message

    def _message(
        self, message: Message, number: int, lanes: dict[str, _Lane], files: ExitStack
    ) -> None:
        if message.role == METADATA:
            self._describe(message)
            return
        lane = lanes.get(message.topic)
        if lane is None:
            path = self._folder / f"{number}-{len(lanes)}.pcap"
            address = self._topics.addresses[message.topic]
            lane = lanes[message.topic] = _Lane(files.enter_context(PcapFile(path, address)))
            self._paths.append(path)
        if message.role == PACKETS:
            self._packets(lane, message)
        else:
            self._points(lane, message)

    def _packets(self, lane: _Lane, message: Message) -> None:
        is_companion = message.topic not in self._topics.names.values()
        for datagram in datagrams(message.body, message.kind):
            port = DESCRIPTION_PORT if is_companion else datagram.port
            time_ns = lane.time_ns(datagram.stamp_ns, message.time_ns)
            if not 0 < len(datagram.payload) <= LARGEST_BYTES:
                self._drop("datagram_size")
            else:
                lane.file.write(time_ns, port, datagram.payload)

    def _points(self, lane: _Lane, message: Message) -> None:
        try:
            cloud = (
                custom(message.body, is_ros1=message.is_ros1)
                if message.role == CUSTOM
                else point_cloud(message.body)
            )
        except (ValueError, TypeError):
            return self._drop("message_unreadable")
        if cloud is None:
            return self._drop("cloud_without_times")
        for stop_ns, payload in lane.packer.push(cloud):
            self._point_packet(lane, stop_ns, payload)
        lane.bag_ns = message.time_ns
        return None

    def _point_packet(self, lane: _Lane, stop_ns: int, payload: bytes) -> None:
        lane.file.write(lane.time_ns(stop_ns, lane.bag_ns), POINTS_PORT, payload)

    def _describe(self, message: Message) -> None:
        """Keep the last metadata of a namespace for the lidar in it."""
        space = message.topic.rsplit("/", 1)[0]
        own = [topic for topic in self._topics.names.values() if topic.startswith(f"{space}/")]
        for topic in own:
            content = str(message.body.data).encode()
            address = self._topics.addresses[topic]
            self._units[address] = (address, message.topic, content, False)

    def _note(self, bag: Bag, lanes: dict[str, _Lane]) -> None:
        for topic, lane in lanes.items():
            source = "its driver's stamps" if lane.is_stamped else "the times of the bag"
            remark = f"messages {bag.topics[topic][0]}, host times are {source}"
            notes = self._notes.setdefault(topic, [])
            if remark not in notes:
                notes.append(remark)

    def _drop(self, reason: str) -> None:
        self._drops[reason] = self._drops.get(reason, 0) + 1

    def _tell(self, bag: Bag, count: int) -> None:
        if self._progress is not None:
            here = bag.size * count // max(bag.messages, count, 1)
            self._progress(self._done + here, self._total)

    def unpacked(self) -> Unpacked:
        """Give what came of it."""
        if not self._count:
            raise _no_topics(self._bags, self._drops)
        return Unpacked(
            tuple(self._paths),
            self._topics,
            tuple(self._units.values()),
            tuple(self._captures),
            self._drops,
            {topic: tuple(notes) for topic, notes in self._notes.items()},
        )


def _no_topics(bags: Sequence[Bag], drops: dict[str, int] | None = None) -> CaptureError:
    names = ", ".join(bag.path.name for bag in bags)
    topics = [f"{topic} ({kind})" for bag in bags for topic, (kind, _) in bag.topics.items()]
    others = [topic for bag in bags for topic in bag.others]
    facts = [("topics", ", ".join([*topics, *others][:12]) or "none")]
    facts.extend((reason, str(count)) for reason, count in (drops or {}).items())
    return CaptureError(
        f"no lidar packets in {names}",
        code="capture.no_lidar",
        facts=facts,
        hint="record the packets of the driver, or clouds with a time per point",
    )
