/** The side of the page: robots with their objectives and roles, the obstacles, the events. */

import { memo } from "preact/compat";
import { useLayoutEffect, useMemo, useRef } from "preact/hooks";
import type { Eye } from "../map/camera";
import type { Player } from "../run/player";
import { at, label, loadsOf, moment, placeOf, roleOf, type Run, type RunEvent, transitAt, UNORDERED } from "../run/run";
import { EventSign, RobotSign, StatusSign } from "./shell";

interface PanelProps {
  run: Run;
  tick: number;
}

interface RobotsProps extends PanelProps {
  eye: Eye;
}

export function Robots({ run, tick, eye }: RobotsProps) {
  return (
    <section class="panel robots" aria-labelledby="robots-title">
      <h2 id="robots-title">Robots</h2>
      <ul>
        {run.robots.map((robot, i) => {
          const [, words] = at(robot.tasks, tick);
          const [, rounds] = at(robot.progress, tick);
          const role = roleOf(run, robot, tick);
          const transit = transitAt(robot, tick);
          const loads = loadsOf(run, i, tick);
          const charge = robot.charge ? at(robot.charge, tick)[1] : null;
          const onItsWay = transit ? `, in transit to ${label(run, transit[2])}` : "";
          return (
            <li key={robot.name}>
              <button
                type="button"
                class="go"
                title={`Follow ${robot.name} on the map`}
                aria-pressed={eye.followed === i}
                onClick={() => eye.follow(eye.followed === i ? null : i)}
              >
                <RobotSign robot={robot} size={22} />
              </button>
              <div>
                <p>
                  <b>{robot.name}</b>{" "}
                  <span class="quiet model">{robot.model}</span>{" "}
                  {charge !== null && (
                    <span class="quiet charge" title="Charge of its battery">
                      <meter style={{ width: "28px" }} min={0} max={100} low={20} value={charge} /> {charge} %
                    </span>
                  )}
                  {role && <span class="badge" style={{ color: `var(--${role[0] === "helps" ? "stack" : "requested"})` }}>{role[1]}</span>}
                </p>
                <p class="objective">
                  {words}
                  <span class="quiet">
                    {rounds > 0 && ` · ${rounds} ${rounds === 1 ? "round" : "rounds"}`}
                  </span>
                </p>
                <p class="quiet">
                  at {label(run, robot.path[tick]!).replace(", ", ",\u00a0")}
                  {onItsWay}
                  {loads.length > 0 && ` · carries ${loads.map((load) => load.label).join(", ")}`}
                </p>
              </div>
            </li>
          );
        })}
      </ul>
    </section>
  );
}

export function Obstacles({ run, tick }: PanelProps) {
  if (run.obstacles.length === 0) return null;
  return (
    <section class="panel obstacles" aria-labelledby="obstacles-title">
      <h2 id="obstacles-title">Obstacles</h2>
      <ul>
        {run.obstacles.map((obstacle) => {
          const status = at(obstacle.status, tick)[1];
          if (status === "absent") return null;
          const need = status === "resolved" ? undefined : obstacle.needs[at(obstacle.met, tick)[1]];
          return (
            <li key={obstacle.name} data-obstacle={obstacle.name} data-status={status}>
              <StatusSign run={run} status={status} /> <b>{obstacle.label}</b>{" "}
              <span class="quiet">
                {obstacle.ordered && status === "hidden" ? UNORDERED : run.marks.status[status].meaning}
                {need && `, needs ${need}`}
              </span>
            </li>
          );
        })}
      </ul>
    </section>
  );
}

/** The most goals that are listed; a lane and the timeline have all of them. */
const MANY_GOALS = 60;

interface EventsProps {
  run: Run;
  player: Player;
  tick: number;
  eye: Eye;
}

export function Events({ run, player, tick, eye }: EventsProps) {
  const events = useMemo(() => {
    const goals = run.events.filter((event) => event[1] === "goal").length;
    return folded(goals <= MANY_GOALS ? run.events : run.events.filter((event) => event[1] !== "goal"));
  }, [run]);
  const list = useRef<HTMLOListElement>(null);
  useLayoutEffect(() => mark(list.current!, events, tick), [events, tick]);
  return (
    <section class="panel events" aria-labelledby="events-title">
      <h2 id="events-title">
        Events <span class="quiet">{events.length}</span>
      </h2>
      <ol class="list" ref={list} tabIndex={-1} style={{ "--digits": moment(run, run.last).length }}>
        <Rows run={run} player={player} events={events} eye={eye} />
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

const Rows = memo(({ run, player, events, eye }: RowsProps) => (
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
            const region = event[4] >= 0 ? event[4] : (run.robots[event[3]]?.path[event[0]] ?? -1);
            if (region >= 0 && eye.followed === null) eye.show(...placeOf(run, region));
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
