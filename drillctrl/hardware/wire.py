"""Datagrams between the bench and what controls: their layout, and what is not one of them.

All numbers are little-endian. The bench sends a sample,

    magic "DCB1" · sequence, uint32 · time, set points (3), delay, outputs (p): float64 each,

and is answered by ``magic · sequence, uint32 · inputs (m), float64``. Sequence numbers of
samples rise from 1; the answer has that of its sample. A controller begins with an answer of
sequence 0, whose inputs are not looked at; the bench ends with a sample of sequence 0.
"""

from __future__ import annotations

import contextlib
import ipaddress
import math
import socket
import struct
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import NamedTuple

from drillctrl.base.errors import InputError, checked_integer

MAGIC = b"DCB1"
LOOPBACK = "127.0.0.1"
# Set points: rotary speed, feed and rock.
POINTS = 3
# Fits one frame of any network.
_MOST_NUMBERS = 128
_LONGEST = 2048

Address = tuple[str, int]


class Sample(NamedTuple):
    """What the bench sends.

    Attributes
    ----------
    sequence : int
        From 1 on; 0 says that the run is over.
    time : float
        Of the simulated motion.
    points : tuple of float
        ω0, δ0 and ψ that top end and rock impose now; of a rig its rotary speed (rad/s), rate of
        penetration (m/s) and rock strength (Pa).
    delay : float
        Steady delay τ0 at this rotary speed.
    outputs : tuple of float
        What is measured, as perturbations from steady drilling at the start.
    """

    sequence: int
    time: float
    points: tuple[float, ...]
    delay: float
    outputs: tuple[float, ...]

    def pack(self) -> bytes:
        """Return the datagram."""
        numbers = (self.time, *self.points, self.delay, *self.outputs)
        return MAGIC + struct.pack(f"<I{len(numbers)}d", self.sequence, *numbers)


def unpack_sample(data: bytes, outputs: int) -> Sample | None:
    """Return a sample from a datagram, or None if it is none."""
    form = f"<4sI{2 + POINTS + outputs}d"
    if len(data) != struct.calcsize(form):
        return None
    magic, sequence, when, *rest = struct.unpack(form, data)
    if magic != MAGIC:
        return None
    return Sample(sequence, when, tuple(rest[:POINTS]), rest[POINTS], tuple(rest[POINTS + 1 :]))


def pack_answer(sequence: int, inputs: Sequence[float]) -> bytes:
    """Return the datagram that answers a sample."""
    return MAGIC + struct.pack(f"<I{len(inputs)}d", sequence, *inputs)


@dataclass
class Counts:
    """Datagrams that were no answer to the sample that waited for one.

    Attributes
    ----------
    malformed : int
        Of another length or without the magic.
    not_finite : int
        With a number that is none, or infinite.
    late : int
        To an earlier sample that had been given up.
    repeated : int
        To a sample that was answered already.
    ahead : int
        To a sample that was not sent yet.
    strangers : int
        From another address than the controller's.
    """

    malformed: int = 0
    not_finite: int = 0
    late: int = 0
    repeated: int = 0
    ahead: int = 0
    strangers: int = 0

    @property
    def total(self) -> int:
        """All of them."""
        return sum(asdict(self).values())


class Line:
    """The bench's end of the line.

    Parameters
    ----------
    host : str
        Address of this machine to listen on.
    port : int
        0 for any that is free.
    outputs, inputs : int
        How many are sent, and come back.

    Raises
    ------
    InputError
        If host or port is none, or taken.
    """

    def __init__(self, host: str, port: int, outputs: int, inputs: int) -> None:
        try:
            version = ipaddress.ip_address(host).version
        except ValueError:
            wanted = f"an address of this machine, such as {LOOPBACK}"
            raise InputError("host", host, wanted) from None
        checked_integer("port", port, 0, 65535)
        checked_integer("outputs", outputs, 1, _MOST_NUMBERS)
        checked_integer("inputs", inputs, 1, _MOST_NUMBERS)
        family = socket.AF_INET if version == 4 else socket.AF_INET6
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise InputError("port", port, f"one that is free ({error.strerror})") from None
        self._form, self._outputs = f"<4sI{inputs}d", outputs
        self._peer: Address | None = None
        self._given_up: set[int] = set()
        self.counts = Counts()

    @property
    def address(self) -> Address:
        """Where it listens."""
        host, port = self._socket.getsockname()[:2]
        return str(host), int(port)

    def close(self) -> None:
        """Tell the controller that the run is over, and close."""
        if self._peer is not None:
            with contextlib.suppress(OSError):
                over = Sample(0, 0.0, (0.0,) * POINTS, 0.0, (0.0,) * self._outputs).pack()
                self._socket.sendto(over, self._peer)
        self._socket.close()

    def _receive(self, until: float) -> tuple[bytes, Address] | None:
        """Return the next datagram, or None if none comes until an instant."""
        left = until - time.perf_counter()
        # What is here already is read even then.
        self._socket.settimeout(max(left, 0.0))
        try:
            data, peer = self._socket.recvfrom(_LONGEST)
        except OSError:
            return None
        return data, (str(peer[0]), int(peer[1]))

    def greet(self, until: float) -> Address | None:
        """Wait for a controller to begin; return where it is, or None if none does."""
        while time.perf_counter() < until:
            # In pieces, so that an interrupt is heard on every system.
            found = self._receive(min(until, time.perf_counter() + 0.5))
            if found is None:
                continue
            sequence, _ = self._read(found[0])
            if sequence == 0:
                self._peer = found[1]
                return self._peer
            self.counts.ahead += sequence is not None
        return None

    def _read(self, data: bytes) -> tuple[int | None, tuple[float, ...]]:
        """Return sequence and inputs of an answer; no sequence if it is none."""
        if len(data) != struct.calcsize(self._form):
            self.counts.malformed += 1
            return None, ()
        magic, sequence, *inputs = struct.unpack(self._form, data)
        if magic != MAGIC:
            self.counts.malformed += 1
            return None, ()
        return sequence, tuple(inputs)

    def send(self, sample: Sample) -> None:
        """Send a sample; what the system refuses is a sample that gets no answer."""
        assert self._peer is not None
        with contextlib.suppress(OSError):
            self._socket.sendto(sample.pack(), self._peer)

    def answer(self, sequence: int, until: float) -> tuple[float, ...] | None:
        """Return the inputs that answer a sample, or None if none came until an instant."""
        while True:
            found = self._receive(until)
            if found is not None:
                inputs = self._matching(sequence, *found)
                if inputs is not None:
                    return inputs
            if time.perf_counter() >= until:
                self._given_up.add(sequence)
                return None

    def _matching(self, wanted: int, data: bytes, peer: Address) -> tuple[float, ...] | None:
        """Return the inputs of a datagram if it answers a sample; count it if not."""
        if peer != self._peer:
            self.counts.strangers += 1
            return None
        sequence, inputs = self._read(data)
        if sequence is None:
            return None
        if sequence > wanted:
            self.counts.ahead += 1
        elif sequence in self._given_up:
            self._given_up.discard(sequence)
            self.counts.late += 1
        elif sequence < wanted:
            self.counts.repeated += 1
        elif not all(map(math.isfinite, inputs)):
            self.counts.not_finite += 1
        else:
            return inputs
        return None
