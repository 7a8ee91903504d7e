"""The sockets of another process, as Linux lists them."""

import contextlib
import ctypes
import os
import socket
from pathlib import Path

TABLES = ("tcp", "tcp6", "udp", "udp6")
SO_BINDTODEVICE = getattr(socket, "SO_BINDTODEVICE", 25)


def addresses(process: int) -> list[tuple[str, str, str]]:
    """The protocol, the own and the other address of each socket of a process."""
    inodes = set()
    for entry in Path(f"/proc/{process}/fd").iterdir():
        with contextlib.suppress(OSError):
            target = str(entry.readlink())
            if target.startswith("socket:"):
                inodes.add(target[8:-1])
    found = []
    for table in TABLES:
        for line in Path(f"/proc/{process}/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[9] in inodes:
                found.append((table, read(fields[1]), read(fields[2])))
    return found


def read(text: str) -> str:
    """An address of /proc/net, without its port."""
    words = bytes.fromhex(text.partition(":")[0])
    whole = b"".join(words[i : i + 4][::-1] for i in range(0, len(words), 4))
    return socket.inet_ntop(socket.AF_INET if len(whole) == 4 else socket.AF_INET6, whole)


def confined(process: int) -> set[str] | None:
    """The interfaces of the sockets of a process that are bound to any address, by its own view of
    them: duplicates of its descriptors. None if this kernel or user may not look into others."""
    found = set()
    held = os.pidfd_open(process)
    try:
        for entry in Path(f"/proc/{process}/fd").iterdir():
            if not str(entry.readlink()).startswith("socket:"):
                continue
            taken = ctypes.CDLL(None).syscall(438, held, int(entry.name), 0)  # pidfd_getfd
            if taken < 0:
                return None
            with socket.socket(fileno=taken) as one:
                if one.family not in (socket.AF_INET, socket.AF_INET6):
                    continue
                if one.getsockname()[0] in ("0.0.0.0", "::"):
                    name = one.getsockopt(socket.SOL_SOCKET, SO_BINDTODEVICE, 16)
                    found.add(name.rstrip(b"\0").decode())
    finally:
        os.close(held)
    return found


def is_loopback(address: str) -> bool:
    return address.startswith("127.") or address in ("::1", "::ffff:127.0.0.1")
