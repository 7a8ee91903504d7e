/** Changes to the world of a run: the tools, their effects on the map, and the line that explains them. */

import type { ComponentChildren } from "preact";
import { useLayoutEffect, useMemo, useState } from "preact/hooks";
import { App, OutcomeBadge } from "../app";
import { extentOf, type Eye } from "../map/camera";
import type { Hand } from "../map/cursor";
import { flatStage } from "../map/map";
import { ordered, square } from "../map/shapes";
import { Button, heard, type Keys, notice, Popup, Press } from "../panels/shell";
import { Controls } from "../panels/timeline";
import { at, type EventKind, HEADINGS, isWall, label, type Obstacle, regionAt, type Run } from "../run/run";
import { isOrder, type ObjectiveKind, type Palette, resolving } from "../studio/model";
import type { LivePlayer, Say, Wire } from "./player";

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

export const OVER = "The run has ended: Restart runs the scenario again";

/** Return the obstacles that are present after a tick. */
export function standing(run: Run, tick: number): Obstacle[] {
  return run.obstacles.filter((o) => !["absent", "resolved"].includes(at(o.status, tick)[1]));
}

export function World({ run, tick, palette, out, inputs, tool, choose, say, over }: WorldProps) {
  const there = standing(run, tick);
  const types = palette.obstacles;
  const off = over && OVER;
  const change = (kind: string, data: object) => () => say("change", { kind, ...data });
  const waits = waitsFor(run);
  const kinds = types.filter(({ blocks }) => blocks).flatMap((type) => (type.truth ? [true, false] : [true]).map((truth) => ({ type, truth })));
  const choice = (words: string, next: Tool, title?: string) => (
    <Press key={words} aria-pressed={isSame(tool, next)} off={next.does !== "look" && off} title={title} act={() => choose(next)}>{words}</Press>
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
            <p class="truth row wrap" key={o.name}>
              <b>{o.label}</b> <Press act={change("resolved", { obstacle: o.name })}>mark resolved</Press>
              <Press act={change("permanent", { obstacle: o.name })}>mark permanent</Press>
            </p>
          ))}
          <Press act={change("give_up", {})}>Give up</Press>
        </div>
      )}
      <h2 id="world-title">Change the world</h2>
      <div class="tools-of-world row wrap" role="group" aria-label="What a click on the map does">
        {choice("Look", { does: "look" })}
        {types
          .filter((type) => isOrder(type, run.robots))
          .map((type) => choice(`Order: ${type.name}`, { does: "order", type: type.name }, `Order ${type.name} in a region; ${resolving(type)} delivers it`))}
        <select
          aria-label="Close a region with"
          value={tool.does === "close" ? closing(tool) : ""}
          disabled={over}
          title={off || "Close a free region with an obstacle"}
          onChange={({ currentTarget: { value } }) => {
            const kind = kinds.find(({ type, truth }) => closing({ type: type.name, truth }) === value);
            if (kind) choose({ does: "close", type: kind.type.name, truth: kind.truth });
          }}
        >
          <option value="">Close with ...</option>
          {kinds.map(({ type, truth }) => (
            <option key={type.name} value={closing({ type: type.name, truth })} title={`${resolving(type)} resolves it`}>
              {type.truth ? `${type.name}, ${truth ? "passable" : "impassable"}` : type.name}
            </option>
          ))}
        </select>
        {choice("Remove", { does: "open" })}
      </div>
      {Object.entries(inputs).map(([input, on]) => (
        <p class="truth row wrap" key={input}>
          <b>{input}</b>{" "}
          <Press role="switch" aria-checked={on} aria-label={input} off={off} act={change("input", { input, on: !on })}>{on ? "on" : "off"}</Press>
        </p>
      ))}
      <ul class="crew">
        {run.robots.map(({ name, look, headings }) => (
          <li key={name} class="row">
            <b style={{ "--colour": look.colour }}>{name}</b>
            {choice("Assign", { does: "send", robot: name, regions: [] })}
            {waits !== null &&
              (headings === null ? [null] : HEADINGS).map((heading) =>
                choice(heading ? `Put facing ${heading}` : "Put back", { does: "put", robot: name, heading }, "Then click its region"),
              )}
            <Press off={off} act={change("service", { robot: name, active: out.has(name) })}>
              {out.has(name) ? "Back in service" : "Out of service"}
            </Press>
          </li>
        ))}
      </ul>
    </section>
  );
}

const closing = ({ type, truth }: { type: string; truth: boolean }): string => `${type} ${truth}`;

/** Whether a tool is chosen; one that sends a robot is, whatever its regions so far. */
function isSame(tool: Tool, other: Tool): boolean {
  return JSON.stringify({ ...tool, regions: [] }) === JSON.stringify({ ...other, regions: [] });
}

type ToolLineProps = Pick<WorldProps, "run" | "tool" | "choose" | "say" | "over"> & { objectives: ObjectiveKind[] };

/** A line above the map: the effect of a click, or the regions and kinds of an objective. */
export function ToolLine({ run, tool, choose, say, over, objectives }: ToolLineProps) {
  return (
    <div class="tool-line row wrap" aria-live="polite">
      {tool.does === "send" && !over ? (
        <Assignment run={run} tool={tool} choose={choose} say={say} objectives={objectives} />
      ) : (
        <p class="quiet">{over ? `${OVER}.` : hintOf(tool)}</p>
      )}
      {tool.does !== "look" && !over && (
        <Press title="Back to viewing (Esc)" act={() => choose({ does: "look" })}>Done</Press>
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
        <Press
          key={kind.kind}
          off={wrongCount(kind, regions.length)}
          title={kind.meaning}
          act={() => send({ [kind.kind]: kind.one ? regions[0] : regions })}
        >
          {kind.label}
        </Press>
      ))}
    </>
  );
}

function hintOf(tool: Tool): string {
  if (tool.does === "put") return `Click the region where ${tool.robot} stands now.`;
  if (tool.does === "close") return `Click a free region: ${tool.type} closes it at the next tick.`;
  if (tool.does === "order") return `Click a region: ${tool.type} is ordered there at the next tick.`;
  if (tool.does === "open") return "Click an obstacle: it disappears at the next tick.";
  return "Robots discover a closed region as they would in reality; the team immediately knows other changes.";
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

interface LiveControlsProps {
  run: Run;
  player: LivePlayer;
  tick: number;
  eye: Eye;
  /** Null where a program drives the run. */
  say: Say | null;
}

export function LiveControls({ say, ...props }: LiveControlsProps) {
  const { run, player, tick } = props;
  const running = player.state.phase === "running";
  const ended = player.state.phase === "ended";
  return (
    <Controls name="The run" paced={say !== null} end={say && <Again player={player} say={say} />} {...props}>
      {say && (
        <Button icon={running ? "pause" : "play"} label={running ? "Pause the run" : "Run"} primary off={ended && OVER} act={() => player.toggle()} />
      )}
      <Button icon="on" label="Next tick" off={(ended || !say) && tick >= run.last && OVER} act={() => player.step(1)} />
      <Press aria-pressed={player.following} off={player.following && "this is the newest tick"} title="Follow the run" act={() => player.follow()}>
        Live
      </Press>
    </Controls>
  );
}

/** Another run of the same scenario, or the end of this one. */
function Again({ player, say }: { player: LivePlayer; say: Say }) {
  const again = (): void => {
    player.following = true;
    say("restart", { play: true });
  };
  return (
    <div class="group row">
      <Press title="Restart the run" act={again}>Restart</Press>
      <Press off={player.state.phase === "ended" && OVER} title="End the run" act={() => say("end")}>End</Press>
    </div>
  );
}

interface LiveViewProps {
  run: Run | null;
  player: LivePlayer;
  wire: Wire;
  palette: Palette;
  /** Whether a program drives the run, so that pages only show it. */
  watches?: boolean;
  bar?: ComponentChildren;
  saving?: ComponentChildren;
}

const KEYS: Keys = [
  ["Space", "run or pause"],
  ["← →", "previous or next tick; at the newest, → runs one more"],
  ["Home End", "first tick, or the newest, and follow the run"],
  ["Tab", "to the map, where the arrows move and Enter clicks, once a change is chosen"],
  ["Esc", "cancel a change; close a menu"],
];

export function LiveView({ run, player, wire, palette, watches, bar, saving }: LiveViewProps) {
  const [tool, choose] = useState<Tool>({ does: "look" });
  const { cols, rows } = run ?? { cols: 0, rows: 0 };
  const stage = useMemo(() => run && flatStage(extentOf(run)), [run?.grid.join()]);
  const over = player.state.phase === "ended";
  const hand = useWorldHand(run, over || watches ? { does: "look" } : tool, choose, wire.say);
  useLayoutEffect(() => {
    const pressed = (event: KeyboardEvent): void => {
      if (event.key !== "Escape" || event.defaultPrevented) return;
      choose({ does: "look" });
      (document.activeElement as HTMLElement | null)?.blur(); // Space runs again
    };
    return heard(window, { keydown: pressed });
  }, []);
  if (run === null || stage === null) return <Begin player={player} wire={wire} bar={bar} />;
  const tick = player.tick;
  return (
    <App
      key={`${cols}x${rows}`}
      run={run}
      player={player}
      stage={stage}
      extras={{
        title: <Badge player={player} run={run} />,
        bar: (
          <>
            {bar}
            {saving || <Saving />}
          </>
        ),
        above: !watches && <ToolLine run={run} tool={tool} choose={choose} say={wire.say} over={over} objectives={palette.objectives} />,
        beside: !watches && (
          <World
            run={run}
            tick={tick}
            palette={palette}
            out={new Set(run.robots.filter(({ out }) => at(out, run.last)[1]).map(({ name }) => name))}
            inputs={player.state.inputs}
            tool={tool}
            choose={choose}
            say={wire.say}
            over={over}
          />
        ),
        controls: (now) => <LiveControls run={run} player={player} tick={now} eye={stage.eye} say={watches ? null : wire.say} />,
        hand: watches ? undefined : hand,
        keys: KEYS,
        about: "Click a robot to follow it, an event or a mark on the timeline to see that tick while the run continues.",
      }}
    />
  );
}

function Badge({ player, run }: { player: LivePlayer; run: Run }) {
  const { phase, outcome, failure, busy } = player.state;
  if (failure !== null) return <p class="badge" style={{ color: "var(--found)" }} title={failure}>failed: {failure.split("\n")[0]}</p>;
  if (outcome !== null) return <OutcomeBadge outcome={outcome} explanation={run.ending?.explanation ?? ""} />;
  if (waitsFor(run) !== null) return <p class="badge" style={{ color: "var(--found)" }}>waits for an operator</p>;
  return <p class="badge quiet">{busy ? "thinking" : phase}</p>;
}

/** Downloads of the run so far. */
export function RunDownloads() {
  return (
    <>
      <a href="save/trace" download>Trace of the run</a>
      <a href="save/replay" download>Replay (HTML page)</a>
      <a href="save/3d" target="_blank" rel="noopener">Show in 3D</a>
      <a href="save/bundle" download>Bundle with proofs</a>
    </>
  );
}

function Saving() {
  return (
    <Popup kind="menu" name="Save">
      <RunDownloads />
    </Popup>
  );
}

function Begin({ player, wire, bar }: Pick<LiveViewProps, "player" | "wire" | "bar">) {
  const { phase, failure } = player.state;
  const starting = phase === "starting";
  return (
    <div class="begin">
      <div class="group row">{bar}</div>
      <h1>{document.title.split(": safenav")[0]}</h1>
      {failure !== null && <pre class="failure">{failure}</pre>}
      <p>{starting ? "Synthesizing the first controllers …" : "No run yet."}</p>
      <button type="button" class="primary" disabled={starting} onClick={() => wire.say("restart", { play: true })}>
        {failure !== null ? "Try again" : "Run"}
      </button>
    </div>
  );
}
