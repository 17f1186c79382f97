"""The temporary capture that takes the datagrams of one topic: pcap, nanoseconds, raw IPv4."""

import struct
from pathlib import Path
from types import TracebackType
from typing import Self

__all__ = ["LARGEST_BYTES", "PcapFile"]

LARGEST_BYTES = 65_507
"""No UDP datagram over IPv4 is larger."""

NANOS_PER_SECOND = 1_000_000_000
MAGIC_NANOSECONDS = 0xA1B23C4D
LINK_RAW_IPV4 = 228
RECORD = struct.Struct("<IIII")
HEADERS = struct.Struct(">BBHHHBBH4s4sHHHH")
RECEIVER = bytes((198, 18, 0, 0))
BUFFER_BYTES = 1 << 20


class PcapFile:
    """Writes datagrams that one address sends."""

    def __init__(self, path: Path, address: str) -> None:
        self.path = path
        self._address = bytes(map(int, address.split(".")))
        self._file = path.open("wb", buffering=BUFFER_BYTES)
        self._file.write(
            struct.pack("<IHHiIII", MAGIC_NANOSECONDS, 2, 4, 0, 0, 1 << 18, LINK_RAW_IPV4)
        )
        self.count = 0

    def write(self, time_ns: int, port: int, payload: bytes) -> None:
        """Add a datagram; the time counts since 1970 UTC."""
        seconds, nanos = divmod(time_ns, NANOS_PER_SECOND)
        length = 28 + len(payload)
        headers = HEADERS.pack(
            *(0x45, 0, length, 0, 0, 64, 17, 0, self._address, RECEIVER),
            *(port, port, 8 + len(payload), 0),
        )
        self._file.write(RECORD.pack(seconds, nanos, length, length) + headers + payload)
        self.count += 1

    def close(self) -> None:
        """Complete the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
