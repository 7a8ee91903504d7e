/** The page as a whole. */

import type { ComponentChildren } from "preact";
import { useLayoutEffect, useMemo, useRef } from "preact/hooks";
import { Playback } from "./panels/timeline";
import { actionsOf, Header, type Keys, KEYS, listenToKeys, withKeys } from "./panels/shell";
import { Events, Obstacles, Robots } from "./panels/sidebar";
import { Legend } from "./panels/legend";
import type { Player } from "./run/player";
import { type Ending, EVENTS, eventsAfter, eventsAt, type Run, type RunEvent, useRedraw, when } from "./run/run";
import type { Hand } from "./map/cursor";
import type { Stage } from "./map/map";

function isTold([, kind]: RunEvent): boolean {
  return EVENTS[kind][0] !== "rest" || kind === "plan" || kind === "plan_end";
}

interface AppProps {
  run: Run;
  player: Player;
  stage: Stage;
  extras?: Extras;
}

/** Replacements and additions to the page for pages that are more than a replay. */
export interface Extras {
  /** Beside the title. */
  title?: ComponentChildren;
  /** At the right of the title. */
  bar?: ComponentChildren;
  /** Above the map. */
  above?: ComponentChildren;
  /** Beside the map. */
  beside?: ComponentChildren;
  controls?: (tick: number) => ComponentChildren;
  hand?: Hand | undefined;
  /** Keys that differ from those of a replay, and further ones. */
  keys?: Keys;
  /** The effect of a click, for the help. */
  about?: string;
}

export function App({ run, player, stage, extras = {} }: AppProps) {
  const redraw = useRedraw();
  const help = useRef<HTMLDialogElement>(null);
  const { eye } = stage;
  useLayoutEffect(() => player.onTick(redraw), [player]);
  // Before the page shows: a reader who sees it may press a key.
  useLayoutEffect(
    () => listenToKeys({ ...actionsOf(run, player, eye), "?": () => help.current!.showModal() }),
    [run, player, eye],
  );
  const followed = useRef(eye.followed);
  useLayoutEffect(
    () =>
      eye.onChange(() => {
        if (followed.current !== eye.followed) redraw(); // a zoom concerns the stage alone
        followed.current = eye.followed;
      }),
    [eye],
  );
  const tick = player.tick;
  return (
    <>
      <Header
        help={help}
        name={run.name}
        state={extras.title ?? (run.ending ? <OutcomeBadge {...run.ending} /> : <p class="badge quiet">cut off</p>)}
        keys={withKeys(KEYS, extras.keys ?? [])}
        about={
          <>
            <p>{extras.about ?? "Click a robot to follow it, an event or a mark on the timeline to go there; the address names the moment."}</p>
            <p class="quiet">
              {run.source} · safenav {run.version}
            </p>
          </>
        }
      >
        {extras.bar}
      </Header>
      <main class={extras.beside ? "steered" : ""}>
        <section class="stage told" aria-label="Map">
          {extras.above}
          <stage.View
            run={run}
            player={player}
            tick={tick}
            spoken={spokenOf(run, tick)}
            hand={extras.hand}
          />
          <div class="strip row wrap">
            <Story run={run} tick={tick} playing={player.playing} />
            {stage.Tools && <stage.Tools />}
            <Legend run={run} marks={stage.marks} />
          </div>
        </section>
        {extras.controls ? extras.controls(tick) : <Playback run={run} player={player} tick={tick} eye={eye} />}
        {extras.beside}
        <aside aria-label="State of the run">
          <div class="state">
            <Robots run={run} tick={tick} eye={eye} />
            <Obstacles run={run} tick={tick} />
          </div>
          <Events run={run} player={player} tick={tick} eye={eye} />
        </aside>
      </main>
    </>
  );
}

/** How a run ended. */
export function OutcomeBadge({ outcome, explanation }: Pick<Ending, "outcome" | "explanation">) {
  return (
    <p class="badge" style={{ color: `var(--${outcome === "completed" ? "resolved" : "found"})` }} title={explanation}>
      {outcome.replace(/_/g, " ")}
    </p>
  );
}

/** The last important event in words; read aloud when the user steps through the run. */
function Story({ run, tick, playing }: { run: Run; tick: number; playing: boolean }) {
  const told = useMemo(() => run.events.filter(isTold), [run]);
  const end = eventsAfter(told, tick);
  const last = told[end - 1];
  const now = last ? told.slice(eventsAfter(told, last[0] - 1), end) : [];
  now.sort((a, b) => Number(b[1] === "outcome") - Number(a[1] === "outcome")); // why it ended comes first
  const sentences = [...new Set(now.map((event) => event[2]))]; // changes of one moment may repeat a sentence
  const before = last === undefined;
  return (
    <p class="story" aria-live={playing ? "off" : "polite"}>
      {before && run.last === 0 ? null : before ? (
        <span class="quiet">Nothing has been found yet.</span>
      ) : (
        <>
          <b>{last[0] === tick ? "Now" : run.times ? `At ${when(run, last[0])}` : `Tick ${last[0]}`}</b> {sentences.join("; ")}.
        </>
      )}
    </p>
  );
}

/** The region that the story of this tick is about, -1 for none. */
function spokenOf(run: Run, tick: number): number {
  const told = eventsAt(run, tick).filter((event) => isTold(event) && event[4] >= 0);
  return told[told.length - 1]?.[4] ?? -1;
}
