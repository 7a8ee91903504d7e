"""Optional packages: the requirements of each extra, and the command that installs them.

A wheel or a checkout is not on an index, so ``pip install 'safenav[studio]'`` would fetch any
package of that name. The requirements come from safenav's own metadata.
"""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

from safenav.errors import UsageError


def requirements(extra: str = "") -> tuple[str, ...]:
    """Return the requirements of an extra and of the extras that it includes; ``""``: safenav's
    own.

    Empty if safenav is not installed, since there is no metadata.
    """
    # Imported here: it takes longer than the rest of the command line.
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
    """Return the name of the package in a requirement."""
    found = re.match(r"[\w.-]+", requirement)
    return found[0] if found else requirement


def install_command(extra: str = "") -> str:
    """Return the command that installs the requirements of an extra for this Python."""
    pip = "pip" if Path(sys.executable).with_name("pip").exists() else f"{sys.executable} -m pip"
    wanted = requirements(extra)
    if not wanted:  # run from its sources
        return f"{pip} install {shlex.quote(f'{Path(__file__).parents[1]}[{extra}]')}"
    return f"{pip} install {' '.join(map(shlex.quote, wanted))}"


def missing(user: str, package: str, extra: str) -> UsageError:
    """Return the error that ``user`` (a feature) needs a package of an extra."""
    return UsageError(
        f"{user} needs {package}, which is not installed\n    {install_command(extra)}"
    )
