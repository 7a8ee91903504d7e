/** A live run: the replay page, with controls of the run and of its world. */

import { heard } from "../listening";
import type { ComponentChildren } from "preact";
import { useLayoutEffect, useMemo, useState } from "preact/hooks";
import { App, OutcomeBadge } from "../app";
import { outOfService, ToolLine, useWorldHand, waitsFor, World, type Tool } from "../live/changes";
import { LiveControls } from "../live/controls";
import type { LivePlayer } from "../live/player";
import type { Wire } from "../live/wire";
import type { Run } from "../run/run";
import { Popup } from "../panels/button";
import type { Palette } from "./model";
import { flatStage } from "../map/stage";
import type { Keys } from "../panels/header";

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
  const stage = useMemo(() => flatStage({ left: 0, top: 0, right: cols, bottom: rows }), [cols, rows]);
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
  if (run === null) return <Begin player={player} wire={wire} bar={bar} />;
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
            out={outOfService(run, run.last)}
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
        about: <p>Click a robot to follow it, an event or a mark on the timeline to see that tick while the run continues.</p>,
      }}
    />
  );
}

function Badge({ player, run }: { player: LivePlayer; run: Run }) {
  const { phase, outcome, failure, busy } = player.state;
  if (failure !== null) return <p class="badge bad" title={failure}>failed: {failure.split("\n")[0]}</p>;
  if (outcome !== null) return <OutcomeBadge outcome={outcome} explanation={run.ending?.explanation ?? ""} />;
  if (waitsFor(run) !== null) {
    const show = (): void => document.querySelector(".operator")?.scrollIntoView({ block: "center" });
    return <button type="button" class="badge bad" title="Show why, and the remedies" onClick={show}>waits for an operator</button>;
  }
  return <p class="badge cut">{busy ? "thinking" : phase}</p>;
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
