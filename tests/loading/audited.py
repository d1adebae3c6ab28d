"""Read harmful and changed files under Python's audit.

Prints what the readers did that no reader should do: run code, import, start processes, open
sockets, write. A hook of the audit cannot be taken away, so this is a process of its own.
"""

import json
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.loading.payloads import changed, harmful
from tests.loading.readers import READERS

# "compile" is not among them: NumPy parses the header of an array by `ast.literal_eval`
_FORBIDDEN = (
    *("exec", "import", "pickle.find_class", "marshal.", "code.__new__", "function.__new__"),
    *("os.system", "os.exec", "os.spawn", "os.posix_spawn", "os.fork", "subprocess.", "ctypes."),
    *("socket.", "urllib.", "http.", "ftplib.", "smtplib.", "webbrowser.", "shutil."),
    *("os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.chmod", "os.chown", "os.truncate"),
    *("os.link", "os.symlink", "os.putenv", "tempfile."),
)
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


class Audit:
    """Hook that keeps forbidden events while it is `armed`."""

    def __init__(self):
        self.armed = False
        self.found = Counter()

    def __call__(self, event, arguments):
        """Note a forbidden event."""
        if not self.armed:
            return
        if event.startswith(_FORBIDDEN):
            self.found[f"{event} {str(arguments)[:200]}"] += 1
        elif event == "open" and isinstance(arguments[2], int) and arguments[2] & _WRITING:
            self.found[f"{event} {str(arguments)[:200]}"] += 1


def main(n):
    """Read the files of all kinds, n changed ones of each, and print what was found, as JSON."""
    audit = Audit()
    sys.addaudithook(audit)
    print(json.dumps({kind: _audited(reader, n, audit) for kind, reader in READERS.items()}))


def _audited(reader, n, audit):
    """What reading did, how many files were read, and how the others were refused."""
    ends = Counter[str]()
    with tempfile.TemporaryDirectory() as name:
        folder, mark = Path(name), Path(name) / "mark"
        reader.write(folder / reader.name)
        good = (folder / reader.name).read_bytes()
        files = [*harmful(mark), *changed(good, n, 0)]
        assert _read(reader, folder, good, audit) == "read"
        _read(reader, folder, files[0], audit)  # what an error itself imports is not counted
        audit.found.clear()
        for data in files:
            ends[_read(reader, folder, data, audit)] += 1
        return {"found": dict(audit.found), "ran": mark.exists(), "ends": ends}


def _read(reader, folder, data, audit):
    """Read a file with this content; the name of the error, "read" without."""
    (folder / reader.name).write_bytes(data)
    try:
        audit.armed = True
        reader.read(folder / reader.name)
    except (ValueError, OSError) as error:
        return type(error).__name__
    finally:
        audit.armed = False
    return "read"
