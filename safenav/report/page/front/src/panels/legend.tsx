/** The legend: marks of the stage, and signs of events and activities on the timeline. */

import type { ComponentChildren } from "preact";
import { memo } from "preact/compat";
import { Popup } from "./button";
import { EventSign, StatusSign } from "./icons";
import { bar, DOINGS } from "./lanes";
import { EVENTS, STATUSES, UNORDERED, type EventKind, type Run } from "../run/run";
import type { Stage } from "../map/stage";

interface RowProps {
  words: ComponentChildren;
  /** Whether this run has it. */
  shown?: boolean;
  width?: number;
  height?: number;
  viewBox?: string;
  preserveAspectRatio?: string;
  class?: string;
  /** That of the first robot, unless another one is meant. */
  colour?: string | undefined;
  children: ComponentChildren;
}

/** A row of a legend: a drawing and its meaning. */
export function Row({ words, shown = true, colour, children, width = 18, height = 18, ...rest }: RowProps) {
  if (!shown) return null;
  return (
    <li class="row">
      <svg width={width} height={height} aria-hidden="true" {...rest} {...(colour && { style: { "--colour": colour } })}>
        {children}
      </svg>
      {words}
    </li>
  );
}

/** A row for each status of an obstacle. */
export function Statuses({ run }: { run: Run }) {
  const hidden = `obstacle, still hidden${run.obstacles.some((each) => each.ordered) ? `, or ${UNORDERED}` : ""}`;
  return STATUSES.map((status) => (
    <li key={status} class="row">
      <StatusSign run={run} status={status} />
      {status === "hidden" ? hidden : run.marks.status[status].meaning}
    </li>
  ));
}

export const Legend = memo(({ run, Marks }: { run: Run; Marks: Stage["Marks"] }) => (
  <Popup name="Legend" kind="legend">
    <ul style={{ "--colour": run.robots[0]!.look.colour }}>
      <Marks run={run} />
      {Object.entries(EVENTS).map(([kind, [, , meaning]]) =>
        meaning && run.events.some((event) => event[1] === kind) ? (
          <li key={kind} class="row">
            <EventSign run={run} kind={kind as EventKind} />
            {meaning}
          </li>
        ) : null,
      )}
      {DOINGS.map(([kind, meaning]) => (
        <Row key={kind} words={`${meaning}, in its lane`} width={22} height={10} viewBox="0 -0.3 22 4.6" preserveAspectRatio="none">
          <path class={`doing ${kind}`} d={bar(kind, "1", "21")} />
        </Row>
      ))}
      <Row words="synthesis, in its lane" width={22} height={10}>
        <path class="doing synthesis" d="M11 0v10" />
      </Row>
      <Row words="goals, below the timeline" width={10} height={14} class="goals">
        <path d="M5 4v6" />
      </Row>
    </ul>
  </Popup>
));
