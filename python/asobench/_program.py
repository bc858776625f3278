"""The program `asobench`: where it is, and how it is called."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

from ._errors import StudyError

#: The codes that a terminal takes as commands, not as text.
CODES = re.compile(rb"\x1b\[[0-9;?]*[A-Za-z]")


def program() -> str:
    """The program that ASOBENCH names, the one beside this Python, or the one on the path."""
    beside = Path(sysconfig.get_path("scripts"), "asobench")
    found = os.environ.get("ASOBENCH") or (str(beside) if beside.exists() else shutil.which("asobench"))
    if not found:
        raise FileNotFoundError(
            "the program asobench: expected it on the path, or its name in ASOBENCH; cargo install --path . builds it"
        )
    return found


def call(*arguments: Any, show: bool = False, environment: Mapping[str, str] | None = None) -> str:
    """The program's output, or its last line as an error.

    With `show` its progress is shown. Ctrl-C stops the program, which keeps what it has, and is raised again.
    """
    command = [program(), *map(str, arguments)]
    variables = {**os.environ, "NO_COLOR": "1", **(environment or {})}
    reader, writer = _terminal() if show else os.pipe()
    try:
        child = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=writer, env=variables
        )
    finally:
        os.close(writer)
    assert child.stdout is not None
    texts: dict[str, bytes] = {}
    readers = [
        threading.Thread(target=lambda: texts.update(out=child.stdout.read()), daemon=True),  # type: ignore[union-attr]
        threading.Thread(target=lambda: texts.update(err=_read(reader, _shown if show else None)), daemon=True),
    ]
    for thread in readers:
        thread.start()
    _wait(child)
    for thread in readers:
        thread.join()
    child.stdout.close()
    if child.returncode:
        raise StudyError(_last_line(texts["err"]) or f"exit {child.returncode}")
    return texts["out"].decode(errors="replace")


def _wait(child: subprocess.Popen[bytes]) -> None:
    """Waits for the program. Ctrl-C, which a terminal and Jupyter send to it too, stops it."""
    try:
        child.wait()
    except KeyboardInterrupt:
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.wait(timeout=1)
        if child.poll() is None:
            child.send_signal(signal.SIGINT)
        try:
            child.wait(timeout=60)
        except (KeyboardInterrupt, subprocess.TimeoutExpired):
            child.kill()
            child.wait()
        raise


def _terminal() -> tuple[int, int]:
    """A terminal of 80 columns, on which the program draws its bar."""
    import fcntl
    import struct
    import termios

    reader, writer = os.openpty()
    fcntl.ioctl(writer, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    return reader, writer


def _read(descriptor: int, show: Callable[[bytes], None] | None) -> bytes:
    """All that comes; a terminal without a writer is an error of its own."""
    chunks = []
    with contextlib.suppress(OSError):
        while chunk := os.read(descriptor, 65536):
            chunks.append(chunk)
            if show:
                show(chunk)
    os.close(descriptor)
    if show:
        print(file=sys.stderr)
    return b"".join(chunks)


def _shown(chunk: bytes) -> None:
    """Shows the newest line of a progress bar; a notebook knows no command but to begin the line anew."""
    lines = [line for line in re.split(rb"[\r\n]+", CODES.sub(b"", chunk)) if line.strip()]
    if lines:
        out: IO[str] = sys.stderr
        out.write("\r" + lines[-1].decode(errors="replace").strip()[:79].ljust(79))
        out.flush()


def _last_line(text: bytes) -> str:
    lines = [line.strip() for line in re.split(rb"[\r\n]+", CODES.sub(b"", text)) if line.strip()]
    return lines[-1].decode(errors="replace") if lines else ""


def main() -> None:
    """``python -m asobench``: the program itself."""
    os.execv(program(), [program(), *sys.argv[1:]])
