/** The legend: marks of the stage, and signs of events and activities on the timeline. */

import { memo } from "preact/compat";
import { Row } from "../map/legend";
import { Drawer } from "./drawer";
import { EventSign } from "./icons";
import { bar, DOINGS } from "./lanes";
import type { EventKind, Run } from "../run/run";
import type { Stage } from "../map/stage";

/** Meanings of events; the others have the sign of a status. */
const MEANINGS: Record<Exclude<EventKind, "violation" | "request" | "resolved" | "blocked">, string> = {
  outcome: "end of the run",
  assumption: "assumption broken",
  appeared: "obstacle appears",
  gone: "obstacle disappears",
  truth: "truth set",
  reopened: "may be resolvable again",
  waiting: "waits for an operator",
  paused: "waits for a change",
  operator: "operator intervenes",
  failure: "failure",
  act: "action begins",
  deadline: "deadline missed",
  inputs: "inputs changed",
  objective: "objective changed",
  service: "in or out of service",
  synthesis: "synthesis",
  push: "objectives pushed",
  pop: "objectives restored",
  plan: "joint plan begins",
  plan_end: "joint plan ends",
  goal: "goal reached",
};

export const Legend = memo(({ run, Marks }: { run: Run; Marks: Stage["Marks"] }) => {
  const first = run.robots[0];
  return (
    <Drawer name="Legend" kind="legend">
      <ul>
        <Marks run={run} />
        {Object.entries(MEANINGS).map(([kind, meaning]) =>
          run.events.some((event) => event[1] === kind) ? (
            <li key={kind}>
              <EventSign run={run} kind={kind as EventKind} />
              {meaning}
            </li>
          ) : null,
        )}
        {DOINGS.map(([kind, meaning]) => (
          <li key={kind}>
            <svg width="22" height="10" viewBox="0 -0.3 22 4.6" preserveAspectRatio="none" aria-hidden="true" style={{ "--colour": first?.look.colour }}>
              <path class={`doing ${kind}`} d={bar(kind, "1", "21")} />
            </svg>
            {meaning}, in its lane
          </li>
        ))}
        <Row words="synthesis, in its lane" width={22} height={10}>
          <path class="doing synthesis" d="M11 0v10" />
        </Row>
        <Row words="goals, below the timeline" width={10} height={14} class="goals">
          <path d="M5 4v6" />
        </Row>
      </ul>
    </Drawer>
  );
});
