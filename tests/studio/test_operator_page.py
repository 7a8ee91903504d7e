"""A live run in the studio that waits for an operator."""

from __future__ import annotations

from pathlib import Path

from runtime.test_operator import GATE
from safenav.audit.check import audit
from safenav.trace.reading import read_bytes
from safenav.trace.records import Operator, Waiting
from studio.serving import Page, Served, visit


def test_the_page_can_help_a_run_that_waits(tmp_path: Path) -> None:
    scenario = tmp_path / "gate.yaml"
    scenario.write_text(GATE)

    async def story(page: Page) -> None:
        await page.say("speed", value=64)
        await page.say("play")
        await page.hear(
            lambda m: "waiting" in str(m.get("news", m.get("run", {}).get("events", "")))
        )
        await page.say("change", kind="permanent", obstacle="gate@99")
        refused = await page.hear(lambda m: m["is"] == "refused")
        assert "known: gate@27" in refused["message"]
        await page.say("change", kind="resolved", obstacle="gate@27")
        ended = await page.state(phase="ended")
        assert ended["state"]["outcome"] == "completed"
        trace = read_bytes(await page.get("save/trace"))
        assert audit(trace).findings == ()
        assert [r.outcome for r in trace.records if isinstance(r, Waiting)] == ["operator_needed"]
        assert [r.deed for r in trace.records if isinstance(r, Operator)] == ["resolved"]

    with Served("run", scenario, "--live") as served:
        visit(served.address, story)
