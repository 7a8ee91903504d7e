/** Changing the world of a run: what a click on the map does, and the panel that says so. */

import { useState } from "preact/hooks";
import { CELL } from "../map/camera";
import { isWall } from "../map/floor";
import { at, label, type Obstacle, type Robot, type Run } from "../run/run";
import type { Hand } from "../map/stage";
import type { Say } from "./player";

export interface ObstacleKind {
  name: string;
  action: string;
  truth: boolean;
}

/** What the next click on the map does. */
export type Tool =
  | { does: "look" }
  | { does: "close"; type: string; truth: boolean }
  | { does: "open" }
  | { does: "send"; robot: string; regions: number[] };

interface WorldProps {
  run: Run;
  tick: number;
  types: ObstacleKind[];
  out: ReadonlySet<string>;
  tool: Tool;
  choose(tool: Tool): void;
  say: Say;
  over: boolean;
}

/** The obstacles that stand there after a tick. */
export function standing(run: Run, tick: number): Obstacle[] {
  return run.obstacles.filter((o) => tick >= o.since && at(o.status, tick)[1] !== "resolved");
}

export function World({ run, tick, types, out, tool, choose, say, over }: WorldProps) {
  const there = standing(run, tick);
  const truths = there.filter((o) => types.find((type) => type.name === o.type)?.truth);
  const chosen = (does: Tool["does"], name?: string): boolean =>
    tool.does === does && (tool.does !== "close" || tool.type === name) && (tool.does !== "send" || tool.robot === name);
  return (
    <section class="panel world" aria-labelledby="world-title">
      <h2 id="world-title">Change the world</h2>
      <p class="quiet">{over ? "The run has ended: restart it to change its world." : hintOf(tool, run)}</p>
      <div class="tools-of-world" role="group" aria-label="What a click on the map does">
        <button type="button" aria-pressed={tool.does === "look"} onClick={() => choose({ does: "look" })}>
          Look
        </button>
        {types.flatMap((type) =>
          (type.truth ? [true, false] : [true]).map((truth) => (
            <button
              type="button"
              key={`${type.name}${truth}`}
              disabled={over}
              title={`Close a free region with ${type.name}; '${type.action}' resolves it`}
              aria-pressed={chosen("close", type.name) && (tool as { truth: boolean }).truth === truth}
              onClick={() => choose({ does: "close", type: type.name, truth })}
            >
              {type.truth ? `${type.name}, ${truth ? "passable" : "impassable"}` : `Close: ${type.name}`}
            </button>
          )),
        )}
        <button type="button" disabled={over} aria-pressed={tool.does === "open"} onClick={() => choose({ does: "open" })}>
          Take away
        </button>
      </div>
      {truths.map((o) => (
        <p class="truth" key={o.name}>
          <b>{o.label}</b> turns out{" "}
          <button type="button" disabled={over} onClick={() => say("change", { kind: "truth", obstacle: o.name, traversable: true })}>
            passable
          </button>
          <button type="button" disabled={over} onClick={() => say("change", { kind: "truth", obstacle: o.name, traversable: false })}>
            impassable
          </button>
        </p>
      ))}
      <ul class="crew">
        {run.robots.map((robot) => (
          <li key={robot.name}>
            <b style={{ "--colour": robot.look.colour }}>{robot.name}</b>
            <button
              type="button"
              disabled={over}
              aria-pressed={chosen("send", robot.name)}
              onClick={() => choose({ does: "send", robot: robot.name, regions: [] })}
            >
              Send
            </button>
            <button
              type="button"
              disabled={over}
              onClick={() => say("change", { kind: "service", robot: robot.name, active: out.has(robot.name) })}
            >
              {out.has(robot.name) ? "Back in service" : "Out of service"}
            </button>
          </li>
        ))}
      </ul>
      {tool.does === "send" && <Sending run={run} tool={tool} choose={choose} say={say} />}
    </section>
  );
}

/** The regions clicked so far, and what to make of them. */
function Sending({ run, tool, choose, say }: Pick<WorldProps, "run" | "choose" | "say"> & { tool: Tool & { does: "send" } }) {
  const { robot, regions } = tool;
  const send = (objective: object): void => {
    say("change", { kind: "objective", robot, objective });
    choose({ does: "look" });
  };
  return (
    <div class="sending">
      <p>
        {robot}: {regions.length === 0 ? "click regions on the map" : regions.map((r) => label(run, r)).join(", then ")}
      </p>
      <div class="group">
        <button type="button" disabled={regions.length !== 1} onClick={() => send({ hold: regions[0] })}>
          Go there and stay
        </button>
        <button type="button" disabled={regions.length < 2} onClick={() => send({ visit: regions })}>
          Visit in order
        </button>
        <button type="button" disabled={regions.length < 2} onClick={() => send({ cover: regions })}>
          Cover
        </button>
      </div>
    </div>
  );
}

function hintOf(tool: Tool, run: Run): string {
  if (tool.does === "close") return `Click a free region: ${tool.type} is there from the next tick on.`;
  if (tool.does === "open") return "Click an obstacle: it is gone with the next tick.";
  if (tool.does === "send") return `Click regions of the map: ${tool.robot} gets them as its objective.`;
  return run.robots.length > 0 ? "Nobody is told: the team finds out as it would in the world." : "";
}

/** The robots that are out of service after a tick. */
export function outOfService(run: Run, tick: number): Set<string> {
  const found = new Set<string>();
  for (const [when, kind, text, robot] of run.events) {
    if (when > tick) break;
    if (kind !== "service" || robot < 0) continue;
    const name = (run.robots[robot] as Robot).name;
    if (text.endsWith("out of service")) found.add(name);
    else found.delete(name);
  }
  return found;
}

/** A hand that does what the chosen tool says where the map is clicked. */
export function useWorldHand(run: Run | null, tool: Tool, choose: (tool: Tool) => void, say: Say): Hand | undefined {
  const [hovered, hover] = useState(-1);
  if (run === null || tool.does === "look") return undefined;
  const regionAt = (x: number, y: number): number =>
    x >= 0 && y >= 0 && x < run.cols && y < run.rows ? Math.floor(y) * run.cols + Math.floor(x) : -1;
  const marks = tool.does === "send" ? tool.regions : [];
  const square = (region: number, kind: string, key: string) => (
    <rect
      key={key}
      class={`mark-${kind}`}
      x={(region % run.cols) * CELL + 1.5}
      y={Math.floor(region / run.cols) * CELL + 1.5}
      width={CELL - 3}
      height={CELL - 3}
      rx={4}
    />
  );
  return {
    cursor: "crosshair",
    down(x, y) {
      const region = regionAt(x, y);
      if (region < 0 || isWall(run, region)) return false;
      if (tool.does === "close") say("change", { kind: "close", type: tool.type, truth: tool.truth, region });
      else if (tool.does === "open") {
        const found = standing(run, run.last).find((o) => o.region === region);
        if (!found) return false;
        say("change", { kind: "open", obstacle: found.name });
      } else choose({ ...tool, regions: [...tool.regions, region] });
      return true;
    },
    move: (x, y) => hover(regionAt(x, y)),
    up: () => undefined,
    over: (
      <>
        {marks.map((region, i) => square(region, "chosen", `${i}`))}
        {marks.map((region, i) => (
          <text class="order" x={((region % run.cols) + 0.5) * CELL} y={(Math.floor(region / run.cols) + 0.64) * CELL}>
            {i + 1}
          </text>
        ))}
        {hovered >= 0 && !isWall(run, hovered) && square(hovered, "hover", "hover")}
      </>
    ),
  };
}
