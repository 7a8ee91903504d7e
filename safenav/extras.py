"""Optional packages: which requirements an extra has, and the command that installs them here.

A wheel or a checkout is on no index, so ``pip install 'safenav[studio]'`` would fetch whatever has
that name there. The requirements come from safenav's own metadata.
"""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

from safenav.errors import UsageError


def requirements(extra: str = "") -> tuple[str, ...]:
    """The requirements of an extra, those of its own extras included; of safenav itself for ``""``.

    Empty if safenav was not installed: then there is no metadata.
    """
    # Imported where it is needed: it takes longer than the rest of the command line.
    from importlib import metadata

    try:
        listed = metadata.requires("safenav") or []
    except metadata.PackageNotFoundError:
        return ()
    found: list[str] = []
    for entry in listed:
        required, _, marker = (part.strip() for part in entry.partition(";"))
        named = re.search(r"""extra == ['"]([\w-]+)['"]""", marker)
        if (named[1] if named else "") != extra:
            continue
        own = re.fullmatch(r"safenav\[([\w, -]+)\]", required)
        if own is None:
            found.append(re.sub(r"(<[^,]+),(>=.+)", r"\2,\1", required))
        else:
            found += [r for name in own[1].split(",") for r in requirements(name.strip())]
    return tuple(dict.fromkeys(found))


def project(requirement: str) -> str:
    """The package that a requirement names."""
    found = re.match(r"[\w.-]+", requirement)
    return found[0] if found else requirement


def install_command(extra: str = "") -> str:
    """The command that installs the requirements of an extra beside this safenav."""
    pip = "pip" if Path(sys.executable).with_name("pip").exists() else f"{sys.executable} -m pip"
    wanted = requirements(extra)
    if not wanted:  # run from its sources
        return f"{pip} install {shlex.quote(f'{Path(__file__).parents[1]}[{extra}]')}"
    return f"{pip} install {' '.join(map(shlex.quote, wanted))}"


def missing(user: str, package: str, extra: str) -> UsageError:
    """The error that ``user`` needs a package of an extra, which is not installed."""
    return UsageError(
        f"{user} needs {package}, which is not installed\n    {install_command(extra)}"
    )
