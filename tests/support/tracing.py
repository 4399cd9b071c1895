"""Runs Python in an empty home under strace, and reads what it and its children did there.

What is read: sockets that listen or connect, files and folders that are written, programs that are
started, and the variables that each of them gets. Each is one short string, as in SECURITY.md.
"""

from __future__ import annotations

import ipaddress
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory

from pace import PACE, until

NETWORK = ("connect", "sendto", "sendmsg", "sendmmsg")
FILES = (
    *("open", "openat", "creat", "mkdir", "mkdirat", "mknodat", "link", "linkat", "symlink"),
    *("symlinkat", "rename", "renameat", "renameat2"),
)
END_S = 120.0 * PACE  # for a command that ends by itself, or a service that is asked to
PASSED = ("PATH", "PYTHONPATH", "PYTHONPYCACHEPREFIX")
UNREAL = ("/dev/null", "/dev/tty", "/dev/pts/", "/proc/self/")
DNS = 53
_BEGUN = "<unfinished ...>"
_RESUMED = re.compile(r"<\.\.\. \w+ resumed>")
_ADDRESS = re.compile(
    r'sa_family=AF_INET6?, sin6?_port=htons\((\d+)\).*?(?:inet_addr\(|AF_INET6, )"([^"]+)"'
)
_UNIX = re.compile(r'sa_family=AF_UNIX, sun_path=@?"([^"]+)"')
_STRING = re.compile(r'(?:<([^>]*)>, )?"((?:[^"\\]|\\.)*)"')  # with the folder it is relative to
_WRITES = re.compile("O_(?:CREAT|WRONLY|RDWR|TMPFILE)")


@dataclass
class Trace:
    """What a program and its children did. `variables` are those that each child gets from us."""

    status: int
    printed: str
    sockets: set[str] = field(default_factory=set)
    files: set[str] = field(default_factory=set)
    children: set[str] = field(default_factory=set)
    variables: list[dict[str, str]] = field(default_factory=list)


def trace(arguments: Sequence[str], *, ready: str | None = None, seconds: float = 0.0) -> Trace:
    """Run Python until it ends, or is ended some seconds after it prints `ready`."""
    with TemporaryDirectory() as folder:
        names = {"work": ".", "home": "~", "t": "$TMPDIR"}  # short: sockets lie in it
        places = {Path(folder) / name: PurePath(short) for name, short in names.items()}
        work, home, temporary = places
        for place in places:
            place.mkdir()
        env = {name: os.environ[name] for name in PASSED if name in os.environ}
        env |= {"HOME": str(home), "TMPDIR": str(temporary), "LANG": "C.UTF-8"}
        env |= {"PYTHONDONTWRITEBYTECODE": "1", "ORT_DISABLE_TELEMETRY": "0"}  # reports asked for
        log, printed = Path(folder) / "strace", Path(folder) / "printed"
        calls = ",".join(("bind", "execve", *NETWORK, *FILES))
        command = ["strace", "-f", "-y", "-v", "-qq", "-s", "65536", "--seccomp-bpf"]
        command += ["-e", "signal=none", "-e", f"trace={calls}", "-o", str(log)]
        with printed.open("w") as out:
            tracer = subprocess.Popen(
                [*command, sys.executable, *arguments],
                cwd=work,
                env=env,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
                start_new_session=True,
            )
        try:
            if ready is not None:
                until(lambda: ready in printed.read_text() or tracer.poll() is not None, END_S)
                _end_after(tracer, seconds)
            found = Trace(tracer.wait(END_S), printed.read_text())
        finally:
            if tracer.poll() is None:
                os.killpg(tracer.pid, signal.SIGKILL)
        for call, rest in _calls(log):
            _read(found, call, rest, env, places)
    # A folder that something was put into is named by that.
    found.files -= {str(folder) for name in found.files for folder in PurePath(name).parents}
    return found


def _end_after(tracer: subprocess.Popen[bytes], seconds: float) -> None:
    """Ask the program to end as a supervisor does. The tracer itself ignores such signals."""
    try:
        tracer.wait(seconds)
    except subprocess.TimeoutExpired:
        children = Path(f"/proc/{tracer.pid}/task/{tracer.pid}/children").read_text()
        os.kill(int(children.split()[0]), signal.SIGTERM)


def _calls(log: Path) -> Iterator[tuple[str, str]]:
    """Yield the name and the arguments of each call that succeeded, or that asked the network."""
    begun: dict[str, str] = {}
    for line in log.read_text(encoding="utf-8", errors="replace").splitlines():
        process, _, rest = line.partition(" ")
        rest = rest.lstrip()
        if rest.endswith(_BEGUN):  # another process was traced before this call returned
            begun[process] = rest.removesuffix(_BEGUN)
            continue
        if resumed := _RESUMED.match(rest):
            rest = begun.pop(process, "") + rest[resumed.end() :]
        call, _, rest = rest.partition("(")
        arguments, _, result = rest.rpartition(" = ")
        if call in NETWORK or not result.startswith("-1"):
            yield call, arguments


def _read(
    found: Trace, call: str, arguments: str, env: Mapping[str, str], places: Mapping[Path, PurePath]
) -> None:
    if call == "execve":
        program, _, _ = arguments.partition(", [")
        name = Path(program.strip('"')).name
        variables = [text for _, text in _STRING.findall(arguments.rpartition("], [")[2])]
        states = dict(text.split("=", 1) for text in variables)
        found.variables.append({k: v for k, v in states.items() if env.get(k) != v})
        if len(found.variables) > 1:  # the first is the program itself
            found.children.add("python" if name.startswith("python") else name)
    elif call in FILES:
        paths = _STRING.findall(arguments)
        if paths and (not call.startswith("open") or _WRITES.search(arguments)):
            at, path = paths[-1]  # of two the new one
            name = os.path.normpath(Path(at or next(iter(places))) / path)
            if not name.startswith(UNREAL):
                found.files.add(_placed(name, places))
    elif socket_ := _socket(call, arguments, places):
        found.sockets.add(socket_)


def _socket(call: str, arguments: str, places: Mapping[Path, PurePath]) -> str | None:
    verb = "listen" if call == "bind" else "connect"
    if unix := _UNIX.search(arguments):
        return f"{verb} {_placed(unix[1], places)}"
    address = _ADDRESS.search(arguments)
    if address is None:  # it sends on what it has connected, or asks the kernel
        return None
    port, ip = int(address[1]), ipaddress.ip_address(address[2])
    ip = getattr(ip, "ipv4_mapped", None) or ip
    if verb == "listen":
        return f"listen {ip}" if ip.is_unspecified or ip.is_loopback else "listen this machine"
    # A name server of this machine asks others.
    return "connect this machine" if port != DNS and _is_ours(ip) else f"connect {ip}:{port}"


def _is_ours(ip: ipaddress.IPv4Address | ipaddress.IPv6Address) -> bool:
    family = socket.AF_INET if ip.version == 4 else socket.AF_INET6
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((str(ip), 0))
        except OSError:
            return False
    return True


def _placed(name: str, places: Mapping[Path, PurePath]) -> str:
    for place, short in places.items():
        if Path(name).is_relative_to(place):
            return str(short / PurePath(name).relative_to(place))
    return name
