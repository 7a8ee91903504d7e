"""One run of a slugs binary: safenav's enforces its limits itself, upstream's has none."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Union

from msgspec import Struct

from safenav.outcome import Verdict
from safenav.synthesis.binary import Binary, find_own_binary
from safenav.synthesis.process import OVERTIME_SECONDS, Finished, ProcessGroup, limited, limits
from safenav.synthesis.request import Job, RequestKind
from safenav.synthesis.result import failure

if TYPE_CHECKING:
    from safenav.synthesis.serving.served import ServedStrategy

Served = tuple[Union["ServedStrategy", Verdict], float]
"""The end of a server, and the seconds until then."""

Brought = Finished | Served


class Program(Struct, frozen=True):
    """A binary with the limits of each single synthesis (wall seconds; None: no limit)."""

    binary: Binary
    seconds: float | None
    memory_mb: int | None

    def answer(self, crew: ProcessGroup, job: Job) -> Brought:
        """Run until the job has a result. Raises SynthesizerError; DismissedError with the crew."""
        if job.kind is RequestKind.MOVES:
            # Imported here: few runs need it.
            from safenav.synthesis.serving.served import serve

            begun = time.monotonic()
            own = self.binary if self.binary.native else find_own_binary()
            served = serve(
                job.spec,
                own,
                options=job.options,
                seconds=self.seconds,
                memory_mb=self.memory_mb,
                crew=crew,
            )
            return served, time.monotonic() - begun
        return (self._run_native if self.binary.native else self._run_foreign)(crew, job)

    def _run_native(self, crew: ProcessGroup, job: Job) -> Finished:
        """Run safenav's own program, which reads standard input and enforces its limits itself."""
        command = [str(self.binary.path), *job.options]
        if job.kind is RequestKind.REALIZABILITY:
            command.append("--realizability")
        if job.kind is RequestKind.STRATEGY and job.most_nodes is not None:
            command += ["--nodes", str(job.most_nodes)]
        command += [*limits(self.seconds, self.memory_mb), "-"]
        deadline = None if self.seconds is None else self.seconds + OVERTIME_SECONDS
        return crew.run(command, job.text.encode(), deadline, self.memory_mb, self.binary.ours)

    def _run_foreign(self, crew: ProcessGroup, job: Job) -> Finished:
        """Run upstream's program, which reads slugsin files only and has no limits."""
        # Imported here: it is slow, and safenav's own binary needs no files.
        import tempfile

        text, suffix = job.text.encode(), ".structuredslugs"
        own = find_own_binary()
        if own is not None and own.native:  # it translates to slugsin
            translate = [str(own.path), "--translate", "-"]
            translated = crew.run(translate, text, self.seconds, own=own.ours)
            if translated.timed_out:
                return translated
            if translated.status != 0:
                raise failure("does not translate the specification", translated, own, job.robot)
            text, suffix = translated.stdout, ".slugsin"
        with tempfile.TemporaryDirectory(prefix="safenav-") as directory:
            file = Path(directory) / f"specification{suffix}"
            file.write_bytes(text)
            command = [str(self.binary.path), *job.options, str(file)]
            return crew.run(limited(command, self.memory_mb), b"", self.seconds, self.memory_mb)
