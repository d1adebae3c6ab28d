"""Stand-in for libX11 where it is not installed.

Panda3D's software display is linked against libX11, of which it calls nothing as long as it draws
into memory. The linker only asks whether a library of this name is there.
"""

from __future__ import annotations

import ctypes
import os
import platform
import struct
import sys
from pathlib import Path

from gymnasium.error import DependencyNotInstalled

__all__ = ["empty_library", "provide_x11"]

_X11 = "libX11.so.6"
_MACHINES = {"x86_64": 62, "aarch64": 183}  # e_machine of ELF
_LOAD, _DYNAMIC, _STACK = 1, 2, 0x6474E551  # segments
_NULL, _HASH, _STRINGS, _SYMBOLS, _STRINGS_SIZE, _SYMBOL_SIZE, _NAME = 0, 4, 5, 6, 10, 11, 14
_READ_WRITE = 6


def provide_x11(user: Path) -> None:
    """Load a library that is linked against libX11, on Linux, also where libX11 is missing.

    Then an empty library takes its name, and the functions of the library are linked when they are
    called: those that need libX11 never are.

    Args:
        user: the library.

    Raises:
        DependencyNotInstalled: libX11 is missing, and nothing can take its name: memory is loaded
            as a file of /proc.
    """
    machine = platform.machine()
    if sys.platform != "linux" or machine not in _MACHINES:
        return
    try:
        ctypes.CDLL(_X11)
    except OSError:
        file = os.memfd_create(_X11)
        try:
            os.write(file, empty_library(_X11, machine))
            _KEPT.append(ctypes.CDLL(f"/proc/self/fd/{file}", mode=ctypes.RTLD_GLOBAL))
        except OSError as error:
            raise DependencyNotInstalled(
                f"pictures need {_X11}, or /proc to do without it: install libx11-6 ({error})"
            ) from error
        finally:
            os.close(file)
        open_library = ctypes.CDLL(None).dlopen  # `ctypes.CDLL` would link all functions at once
        open_library.restype, open_library.argtypes = (
            ctypes.c_void_p,
            [ctypes.c_char_p, ctypes.c_int],
        )
        open_library(os.fsencode(user), os.RTLD_LAZY | os.RTLD_GLOBAL)


_KEPT: list[ctypes.CDLL] = []


def empty_library(name: str, machine: str) -> bytes:
    """A shared library without a symbol, in the format ELF (64 bits, little-endian).

    Args:
        name: under which the linker knows it.
        machine: "x86_64" or "aarch64".

    Source: System V Application Binary Interface, chapters 4 and 5.
    """
    header, segment, symbol = 64, 56, 24
    strings = b"\0" + name.encode() + b"\0"
    at_symbols = header + 3 * segment
    at_hash = at_symbols + symbol  # one symbol: the undefined one
    at_dynamic = at_hash + 16
    at_strings = at_dynamic + 7 * 16
    end = at_strings + len(strings)
    dynamic = [
        (_NAME, 1),
        (_HASH, at_hash),
        (_STRINGS, at_strings),
        (_SYMBOLS, at_symbols),
        (_STRINGS_SIZE, len(strings)),
        (_SYMBOL_SIZE, symbol),
        (_NULL, 0),
    ]
    segments = [
        (_LOAD, _READ_WRITE, 0, 0, 0, end, end, 0x10000),
        (_DYNAMIC, _READ_WRITE, *(at_dynamic,) * 3, *(16 * len(dynamic),) * 2, 8),
        (_STACK, _READ_WRITE, 0, 0, 0, 0, 0, 16),
    ]
    kind = b"\x7fELF\x02\x01\x01" + bytes(9)  # 64 bits, little-endian, version 1
    return b"".join(
        [
            struct.pack(
                "<16sHHIQQQIHHHHHH",
                *(kind, 3, _MACHINES[machine], 1, 0, header, 0, 0, header, segment, 3, 0, 0, 0),
            ),
            *(struct.pack("<IIQQQQQQ", *entry) for entry in segments),
            bytes(symbol),
            struct.pack("<IIII", 1, 1, 0, 0),
            *(struct.pack("<QQ", *entry) for entry in dynamic),
            strings,
        ]
    )
