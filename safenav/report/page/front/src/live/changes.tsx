/** Changes to the world of a run: the tools, their effects on the map, and the line that explains them. */

import { useState } from "preact/hooks";
import { ordered, square } from "../map/marks";
import { notice, unless } from "../panels/notice";
import { at, isWall, label, regionAt, type EventKind, type Obstacle, type Robot, type Run } from "../run/run";
import type { Hand } from "../map/hand";
import { isOrder, resolving, type ObjectiveKind, type Palette } from "../studio/model";
import type { Say } from "./player";

/** The effect of the next click on the map. */
export type Tool =
  | { does: "look" }
  | { does: "close"; type: string; truth: boolean }
  | { does: "order"; type: string }
  | { does: "open" }
  | { does: "put"; robot: string; heading: string | null }
  | { does: "send"; robot: string; regions: number[] };

interface WorldProps {
  run: Run;
  tick: number;
  palette: Palette;
  out: ReadonlySet<string>;
  inputs: Record<string, boolean>;
  tool: Tool;
  choose(tool: Tool): void;
  say: Say;
  over: boolean;
}

const HEADINGS = ["north", "east", "south", "west"];

export const OVER = "The run has ended: Restart runs the scenario again";

/** Return the obstacles that are present after a tick. */
export function standing(run: Run, tick: number): Obstacle[] {
  return run.obstacles.filter((o) => !["absent", "resolved"].includes(at(o.status, tick)[1]));
}

export function World({ run, tick, palette, out, inputs, tool, choose, say, over }: WorldProps) {
  const there = standing(run, tick);
  const types = palette.obstacles;
  const truths = there.filter((o) => types.find((type) => type.name === o.type)?.truth);
  const off = over && OVER;
  const chosen = (does: Tool["does"], name?: string): boolean =>
    tool.does === does &&
    ((tool.does !== "close" && tool.does !== "order") || tool.type === name) &&
    (tool.does !== "send" || tool.robot === name);
  const waits = waitsFor(run);
  // The first type, those of this run and the chosen one have buttons; the others are in a list.
  const near = types.filter(
    ({ name, blocks }, i) => blocks && (i === 0 || run.obstacles.some((o) => o.type === name) || (tool.does === "close" && tool.type === name)),
  );
  return (
    <section class="panel world" aria-labelledby="world-title">
      {waits !== null && !over && (
        <div class="operator" role="group" aria-label="The run waits for an operator">
          <p role="status">{waits}</p>
          <p class="quiet">
            {there.length > 0 && "Resolve an obstacle by hand and mark it resolved, or mark it permanent. "}
            Below, assign another objective or put a robot back. The run then continues.
          </p>
          {there.map((o) => (
            <p class="truth" key={o.name}>
              <b>{o.label}</b>{" "}
              {(["resolved", "permanent"] as const).map((kind) => (
                <button type="button" key={kind} onClick={() => say("change", { kind, obstacle: o.name })}>
                  mark {kind}
                </button>
              ))}
            </p>
          ))}
          <button type="button" onClick={() => say("change", { kind: "give_up" })}>
            Give up
          </button>
        </div>
      )}
      <h2 id="world-title">Change the world</h2>
      <div class="tools-of-world" role="group" aria-label="What a click on the map does">
        <button type="button" aria-pressed={tool.does === "look"} onClick={() => choose({ does: "look" })}>
          Look
        </button>
        {types
          .filter((type) => isOrder(type, run.robots))
          .map((type) => (
            <button
              type="button"
              key={type.name}
              aria-pressed={chosen("order", type.name)}
              {...unless(
                off,
                () => choose({ does: "order", type: type.name }),
                `Order ${type.name} in a region; ${resolving(type)} delivers it`,
              )}
            >
              Order: {type.name}
            </button>
          ))}
        {near.flatMap((type) =>
          (type.truth ? [true, false] : [true]).map((truth) => (
            <button
              type="button"
              key={`${type.name}${truth}`}
              aria-pressed={chosen("close", type.name) && (tool as { truth: boolean }).truth === truth}
              {...unless(
                off,
                () => choose({ does: "close", type: type.name, truth }),
                `Close a free region with ${type.name}; ${resolving(type)} resolves it`,
              )}
            >
              {type.truth ? `${type.name}, ${truth ? "passable" : "impassable"}` : `Close: ${type.name}`}
            </button>
          )),
        )}
        {types.some((type) => type.blocks && !near.includes(type)) && (
          <select
            aria-label="Close with another obstacle"
            value=""
            aria-disabled={over}
            title={over ? OVER : "Close a free region with another obstacle of the catalogue"}
            onChange={(event) => {
              if (over) notice(OVER);
              else choose({ does: "close", type: event.currentTarget.value, truth: true });
              event.currentTarget.value = "";
            }}
          >
            <option value="">Close with ...</option>
            {types
              .filter((type) => type.blocks && !near.includes(type))
              .map(({ name }) => (
                <option key={name}>{name}</option>
              ))}
          </select>
        )}
        <button type="button" aria-pressed={tool.does === "open"} {...unless(off, () => choose({ does: "open" }))}>
          Remove
        </button>
      </div>
      {truths.map((o) => (
        <p class="truth" key={o.name}>
          <b>{o.label}</b> turns out{" "}
          {[true, false].map((traversable) => (
            <button
              type="button"
              key={String(traversable)}
              {...unless(off, () => say("change", { kind: "truth", obstacle: o.name, traversable }))}
            >
              {traversable ? "passable" : "impassable"}
            </button>
          ))}
        </p>
      ))}
      {Object.entries(inputs).map(([input, on]) => (
        <p class="truth" key={input}>
          <b>{input}</b>{" "}
          <button
            type="button"
            role="switch"
            aria-checked={on}
            aria-label={input}
            {...unless(off, () => say("change", { kind: "input", input, on: !on }))}
          >
            {on ? "on" : "off"}
          </button>
        </p>
      ))}
      <ul class="crew">
        {run.robots.map((robot) => (
          <li key={robot.name}>
            <b style={{ "--colour": robot.look.colour }}>{robot.name}</b>
            <button
              type="button"
              aria-pressed={chosen("send", robot.name)}
              {...unless(off, () => choose({ does: "send", robot: robot.name, regions: [] }))}
            >
              Assign
            </button>
            {waits !== null &&
              headingsOf(robot).map((heading) => (
                <button
                  type="button"
                  key={heading ?? ""}
                  aria-pressed={chosen("put") && (tool as { robot: string }).robot === robot.name}
                  {...unless(off, () => choose({ does: "put", robot: robot.name, heading }), "Then click its region")}
                >
                  {heading === null ? "Put back" : `Put facing ${heading}`}
                </button>
              ))}
            <button
              type="button"
              class="service"
              {...unless(off, () => say("change", { kind: "service", robot: robot.name, active: out.has(robot.name) }))}
            >
              {out.has(robot.name) ? "Back in service" : "Out of service"}
            </button>
          </li>
        ))}
      </ul>
    </section>
  );
}

type ToolLineProps = Pick<WorldProps, "run" | "tool" | "choose" | "say" | "over"> & { objectives: ObjectiveKind[] };

/** A line above the map: the effect of a click, or the regions and kinds of an objective. */
export function ToolLine({ run, tool, choose, say, over, objectives }: ToolLineProps) {
  return (
    <div class="tool-line" aria-live="polite">
      {tool.does === "send" && !over ? (
        <Assignment run={run} tool={tool} choose={choose} say={say} objectives={objectives} />
      ) : (
        <p class="quiet">{over ? `${OVER}.` : hintOf(tool)}</p>
      )}
      {tool.does !== "look" && !over && (
        <button type="button" title="Back to viewing (Esc)" onClick={() => choose({ does: "look" })}>
          Done
        </button>
      )}
    </div>
  );
}

/** Return why a kind of objective cannot have this number of regions. */
function wrongCount({ least, most }: ObjectiveKind, count: number): string | false {
  if (most === 1) return count !== 1 && "click exactly one region";
  if (most === null) return count < Math.max(2, least) && `click ${least > 2 ? least : "two"} regions or more`;
  return (count < least || count > most) && `click exactly ${most === 2 ? "two" : most} regions`;
}

/** The regions clicked so far, and the objectives that they can make. */
function Assignment({ run, tool, choose, say, objectives }: Omit<ToolLineProps, "tool" | "over"> & { tool: Tool & { does: "send" } }) {
  const { robot, regions } = tool;
  const send = (objective: object): void => {
    say("change", { kind: "objective", robot, objective });
    choose({ does: "look" });
  };
  return (
    <>
      <p>
        <b>{robot}</b>: {regions.length === 0 ? "click its targets on the map" : regions.map((r) => label(run, r)).join(", ")}
      </p>
      {objectives.map((kind) => (
        <button
          type="button"
          key={kind.kind}
          {...unless(wrongCount(kind, regions.length), () => send({ [kind.kind]: kind.one ? regions[0] : regions }), kind.meaning)}
        >
          {kind.label}
        </button>
      ))}
    </>
  );
}

function hintOf(tool: Tool): string {
  if (tool.does === "put") return `Click the region where ${tool.robot} stands now.`;
  if (tool.does === "close") return `Click a free region: ${tool.type} closes it at the next tick.`;
  if (tool.does === "order") return `Click a region: ${tool.type} is ordered there at the next tick.`;
  if (tool.does === "open") return "Click an obstacle: it disappears at the next tick.";
  return "The robots discover changes as they would in reality.";
}

/** Return the robots that are out of service after a tick. */
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

/** Return the headings in which a robot can be placed. */
function headingsOf(robot: Robot): (string | null)[] {
  return robot.headings === null ? [null] : HEADINGS;
}

/** Return why the run waits for an operator; null if it does not. */
export function waitsFor(run: Run): string | null {
  const waits = new Set<EventKind>(["waiting", "paused", "operator"]);
  const last = [...run.events].reverse().find(([, kind]) => waits.has(kind));
  return last !== undefined && last[1] === "waiting" ? last[2] : null;
}

/** Return a hand that applies the chosen tool to clicked regions. */
export function useWorldHand(run: Run | null, tool: Tool, choose: (next: Tool | ((now: Tool) => Tool)) => void, say: Say): Hand | undefined {
  const [hovered, hover] = useState(-1);
  if (run === null || tool.does === "look") return undefined;
  const marks = tool.does === "send" ? tool.regions : [];
  return {
    cursor: "crosshair",
    down(x, y) {
      const region = regionAt(run, x, y);
      if (region < 0) return false;
      if (isWall(run, region)) notice(`Region ${label(run, region)} is a wall: click a free region.`);
      else if (tool.does === "close") say("change", { kind: "close", type: tool.type, truth: tool.truth, region });
      else if (tool.does === "order") say("change", { kind: "order", type: tool.type, region });
      else if (tool.does === "open") {
        const found = standing(run, run.last).find((o) => o.region === region);
        if (found) say("change", { kind: "open", obstacle: found.name });
        else notice(`Region ${label(run, region)} has no obstacle: click one to remove it.`);
      } else if (tool.does === "put") {
        say("change", { kind: "put_back", robot: tool.robot, region, heading: tool.heading });
        choose({ does: "look" });
      } else if (tool.does === "send") {
        // Two quick clicks come before the page is drawn again: the second adds to the first.
        choose((now) => (now.does === "send" ? { ...now, regions: [...now.regions, region] } : now));
      }
      return true;
    },
    move: (x, y) => hover(regionAt(run, x, y)),
    up: () => undefined,
    leave: () => hover(-1),
    over: (
      <>
        {marks.map((region, i) => square(run, region, "chosen", `${i}`))}
        {ordered(run, marks)}
        {hovered >= 0 && !isWall(run, hovered) && square(run, hovered, "hover", "hover")}
      </>
    ),
  };
}
