"""Topics as senders: each lidar's topics share an address of the range reserved for tests."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

__all__ = ["Topics"]

ADDRESS = re.compile(r"\b198\.1[89]\.\d{1,3}\.\d{1,3}(:\d{1,5})?\b")
COMPANION = re.compile(r"[/_](imu_packets|zone_packets|metadata|(\w*_)?difop\w*|\w*info_packets?)$")
"""Topics of a lidar beside its data."""


@dataclass(frozen=True)
class Topics:
    """Addresses that stand for topics.

    Attributes
    ----------
    names
        Topic by address.
    addresses
        Address by topic; topics of packets that only accompany a lidar's have its address.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    addresses: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, topics: Iterable[str]) -> "Topics":
        """Give the topics addresses in the order of their names."""
        every = sorted(set(topics))
        lidars = [topic for topic in every if not COMPANION.search(topic)] or every
        names = {_address(number): topic for number, topic in enumerate(lidars, 1)}
        by_topic = {topic: address for address, topic in names.items()}
        for topic in every:
            if topic not in by_topic:
                by_topic[topic] = by_topic[max(lidars, key=lambda one: _shared(one, topic))]
        return cls(MappingProxyType(names), MappingProxyType(by_topic))

    def source(self, text: str) -> str | None:
        """Source as the core knows it; None for a topic that is not there."""
        return self.addresses.get(text) if text.startswith("/") else text

    def told(self, value: Any) -> Any:
        """Put topics for their addresses, in texts, lists and dictionaries."""
        if isinstance(value, str):
            return ADDRESS.sub(self._name, value)
        if isinstance(value, Mapping):
            return {key: self.told(entry) for key, entry in value.items()}
        if isinstance(value, list):
            return [self.told(entry) for entry in value]
        return value

    def _name(self, found: re.Match[str]) -> str:
        address = found[0].split(":")[0]
        return self.names.get(address, found[0])


def _address(number: int) -> str:
    return f"198.{18 + (number >> 16)}.{(number >> 8) & 255}.{number & 255}"


def _shared(one: str, other: str) -> int:
    """Count the characters that two names begin with alike."""
    pairs = zip(one, other, strict=False)
    return next((place for place, (a, b) in enumerate(pairs) if a != b), min(len(one), len(other)))
