"""``safenav check-bundle``: check a bundle by the checker that is installed."""

from __future__ import annotations

import json
from pathlib import Path

import click
from msgspec import to_builtins
from msgspec.structs import replace

from safenav.errors import ExitCode

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav certify lab.yaml -o bundle
  safenav check-bundle bundle
  safenav check-bundle bundle --json
\b
With the verified checker (docs/proof.md):
  safenav check-bundle --proved bundle
\b
Exit codes:
  0  accepted   1  refused: the first reason is printed   2  not a bundle
  3  too large for the checker
"""


@click.command(name="check-bundle", epilog=EPILOG)
@click.argument("bundle", type=click.Path(path_type=Path, exists=True))
@click.option("--proved", is_flag=True, help="Also run the proved checker (docs/proof.md).")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(bundle: Path, proved: bool, as_json: bool) -> int:
    """Check a BUNDLE (a folder or a .zip) and print what it establishes, claim by claim.

    The program is the one that is installed, not the copy in the bundle. A reviewer without
    safenav runs `python3 -I -S check.py BUNDLE`.
    """
    from safenav.certify.check import Acceptance, check_bundle
    from safenav.certify.proved import TEAM, prove, refusals, rests_on
    from safenav.report.terminal.table import table

    verdict = check_bundle(bundle)
    proofs = prove(bundle) if proved and verdict.accepted else ()
    if refused := refusals(proofs):
        reason = f"the verified checker refuses {'; '.join(refused)}"
        verdict = replace(verdict, result=Acceptance.REFUSED, reason=reason)
    claims = [{**claim, "rests_on": rests_on(claim, proofs)} for claim in verdict.claims]
    if as_json:
        data = {"verdict": verdict.result, "reason": verdict.reason, "claims": claims}
        data |= {"proofs": [to_builtins(proof) for proof in proofs]} if proved else {}
        click.echo(json.dumps(data, indent=2))
    else:
        said = (f" [{claim['rests_on']}]" if proved else "" for claim in claims)
        rows = [(c["id"], c["text"] + told) for c, told in zip(claims, said, strict=True)]
        for proof in (p for p in proofs if p.kind in TEAM):
            told = ": ".join(filter(None, (proof.verdict, proof.reason)))
            rows.append((proof.kind, f"{TEAM[proof.kind]} [{told}]"))
        if rows:
            click.echo("\n".join(table(("claim", "established"), rows)))
        colour = "green" if verdict.accepted else "red"
        reason = f": {verdict.reason}" if verdict.reason else ""
        click.echo(f"{bundle}: {click.style(verdict.result, fg=colour)}{reason}")
    return {
        Acceptance.ACCEPTED: ExitCode.OK,
        Acceptance.REFUSED: ExitCode.NEGATIVE,
        Acceptance.TOO_LARGE: ExitCode.RESOURCE_LIMIT,
    }[verdict.result]
