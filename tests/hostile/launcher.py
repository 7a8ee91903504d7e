"""Runs a program within limits, and writes what it used: ``launcher.py FILE WORD...``

Linux counts the memory of the process that starts a program in the peak of the program. A test
process may have any size; this one is small."""

import json
import os
import resource
import sys
import time
from pathlib import Path

file, *words = sys.argv[1:]
resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
os.nice(5)
begun = time.monotonic()
_, code, used = os.wait4(os.posix_spawnp(words[0], words, os.environ), 0)
cost = {
    "status": os.waitstatus_to_exitcode(code),
    "megabytes": used.ru_maxrss / 1024,
    "seconds": min(used.ru_utime + used.ru_stime, time.monotonic() - begun),
}
Path(file).write_text(json.dumps(cost))
