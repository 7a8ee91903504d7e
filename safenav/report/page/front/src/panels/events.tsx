/** All events as a list to click, with filters; the ones of the current tick are marked. */

import { memo } from "preact/compat";
import { useLayoutEffect, useMemo, useRef, useState } from "preact/hooks";
import { EventSign } from "./icons";
import type { Player } from "../run/player";
import { moment, type EventKind, type Run, type RunEvent } from "../run/run";

const GROUPS = ["coordination", "synthesis", "goals"] as const;

function groupOf(kind: EventKind): (typeof GROUPS)[number] {
  return kind === "synthesis" ? "synthesis" : kind === "goal" ? "goals" : "coordination";
}

const MANY_GOALS = 60;

interface EventsProps {
  run: Run;
  player: Player;
  tick: number;
  /** Point out a region on the map. */
  point(region: number): void;
}

export function Events({ run, player, tick, point }: EventsProps) {
  const [shown, setShown] = useState<Record<string, boolean>>(() => {
    const goals = run.events.filter((event) => event[1] === "goal").length;
    return { coordination: true, synthesis: true, goals: goals <= MANY_GOALS };
  });
  const events = useMemo(() => folded(run.events.filter((event) => shown[groupOf(event[1])])), [run, shown]);
  const list = useRef<HTMLOListElement>(null);
  useLayoutEffect(() => mark(list.current!, events, tick), [events, tick]);
  return (
    <section class="panel events" aria-labelledby="events-title">
      <h2 id="events-title">
        Events <span class="count">{events.length}</span>
      </h2>
      <div class="filters row" role="group" aria-label="Kinds of events">
        {GROUPS.map((name) => (
          <button
            type="button"
            key={name}
            aria-pressed={shown[name]}
            onClick={() => setShown({ ...shown, [name]: !shown[name] })}
          >
            {name}
          </button>
        ))}
      </div>
      <ol class="list" ref={list} tabIndex={-1} style={{ "--digits": moment(run, run.last).length }}>
        <Rows run={run} player={player} events={events} point={point} />
      </ol>
    </section>
  );
}

/** The syntheses of a tick in one row. */
function folded(events: RunEvent[]): RunEvent[] {
  const rows: RunEvent[] = [];
  let count = 1;
  for (const event of events) {
    const last = rows[rows.length - 1];
    if (event[1] !== "synthesis" || last?.[1] !== "synthesis" || last[0] !== event[0]) {
      rows.push(event);
      count = 1;
    } else rows[rows.length - 1] = [event[0], "synthesis", `${++count} syntheses`, -1, -1];
  }
  return rows;
}

type RowsProps = Omit<EventsProps, "tick"> & { events: RunEvent[] };

const Rows = memo(({ run, player, events, point }: RowsProps) => (
  <>
    {events.map((event, i) => (
      <li key={i}>
        <button
          type="button"
          class="event"
          data-tick={event[0]}
          data-kind={event[1]}
          onClick={() => {
            player.pause();
            player.seek(event[0]);
            point(event[4] >= 0 ? event[4] : event[3] >= 0 ? run.robots[event[3]]!.path[event[0]]! : -1);
          }}
        >
          <span class="tick">{moment(run, event[0])}</span>
          <EventSign run={run} kind={event[1]} />
          <span>{event[2]}</span>
        </button>
      </li>
    ))}
  </>
));

/** Mark the rows of a tick and those to come, and scroll the list, never the page, to the first of them. */
function mark(list: HTMLOListElement, events: RunEvent[], tick: number): void {
  let now: Element | undefined;
  events.forEach((event, i) => {
    const row = list.children[i]!;
    row.classList.toggle("coming", event[0] > tick);
    if (event[0] === tick) row.firstElementChild!.setAttribute("aria-current", "step");
    else row.firstElementChild!.removeAttribute("aria-current");
    if (event[0] <= tick && (now === undefined || event[0] > events[i - 1]![0])) now = row;
  });
  if (now) list.scrollTop = (now as HTMLElement).offsetTop - list.clientHeight / 4;
}
