"""A floor in another process, behind a socket on the loopback: a line of JSON for each call.

``python -m live.wire`` serves one floor: it prints its port, takes one connection, and reads first
what to make the floor of, then lines ``[name, arguments]``, each answered by the result of a method
or the value of an attribute.
"""

import json
import socket
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from live.floor import Floor


class Wired:
    """Has the methods of the floor at the other end, its log and its faults. To be closed."""

    def __init__(self, data: Mapping[str, Any], **more: Any) -> None:
        command = [sys.executable, "-m", "live.wire"]
        tests = Path(__file__).parents[1]
        self.process = subprocess.Popen(command, cwd=tests, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        port = int(self.process.stdout.readline())
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.lines = self.socket.makefile("rw", encoding="utf-8")
        self._ask({"data": data, **more})

    @property
    def log(self) -> Any:
        return self._ask(["log", []])

    @property
    def injected(self) -> Any:
        return self._ask(["injected", []])

    def __getattr__(self, method: str) -> Any:
        return lambda *arguments: self._ask([method, arguments])

    def _ask(self, what: Any) -> Any:
        self.lines.write(json.dumps(what) + "\n")
        self.lines.flush()
        return json.loads(self.lines.readline())

    def close(self) -> None:
        self.lines.close()
        self.socket.close()
        self.process.wait(10)
        if self.process.stdout is not None:
            self.process.stdout.close()


def main() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        print(server.getsockname()[1], flush=True)
        connection, _ = server.accept()
    with connection, connection.makefile("rw", encoding="utf-8") as lines:
        floor = Floor(**json.loads(lines.readline()))
        lines.write("null\n")
        lines.flush()
        for line in lines:
            name, arguments = json.loads(line)
            found = getattr(floor, name)
            lines.write(json.dumps(found(*arguments) if callable(found) else found) + "\n")
            lines.flush()


if __name__ == "__main__":
    main()
