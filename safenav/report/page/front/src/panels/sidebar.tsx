/** The side of the page: robots with their objectives, the stack, the obstacles, the legend. */

import { memo } from "preact/compat";
import { useLayoutEffect, useReducer, useRef } from "preact/hooks";
import type { Eye } from "../map/camera";
import type { Stage } from "../map/stage";
import type { Player } from "../run/player";
import { EventSign, RobotSign, StatusSign } from "./icons";
import { ARROW, bracketsOf } from "../map/knowledge";
import { ANY_LOAD } from "../map/motion";
import { bar, DOINGS } from "./lanes";
import { areaOf, at, label, loadsOf, roleOf, transitAt, type EventKind, type Run, type Status } from "../run/run";
import { Hatch, knowledgeOf, viewersOf } from "../map/shading";

interface PanelProps {
  run: Run;
  tick: number;
}

const DIRECTIONS: Record<string, string> = { N: "north", E: "east", S: "south", W: "west" };

interface RobotsProps extends PanelProps {
  eye: Eye;
  player: Player;
  where: Stage["where"];
}

/** Milliseconds between updates of the positions while a motion plays. */
const PAUSE = 250;

export function Robots({ run, tick, eye, player, where }: RobotsProps) {
  const [, redraw] = useReducer((count: number) => count + 1, 0);
  useLayoutEffect(() => {
    if (!where) return;
    let drawn = 0;
    let late = 0;
    const stop = player.onFrame(() => {
      clearTimeout(late);
      const now = performance.now();
      if (now - drawn > PAUSE) redraw((drawn = now));
      else late = setTimeout(() => redraw(0), PAUSE); // the last frame before a pause counts
    });
    return () => {
      clearTimeout(late);
      stop();
    };
  }, [player, where]);
  const frames = at(run.stack, tick)[1];
  const panel = useRef<HTMLElement>(null);
  useLayoutEffect(() => fade(panel.current!));
  useLayoutEffect(() => {
    const section = panel.current!;
    const observer = new ResizeObserver(() => fade(section));
    observer.observe(section);
    return () => observer.disconnect();
  }, []);
  return (
    <section
      class="panel robots"
      aria-labelledby="robots-title"
      ref={panel}
      onScroll={(event) => fade(event.currentTarget)}
    >
      <h2 id="robots-title">Robots</h2>
      <ul>
        {run.robots.map((robot, i) => {
          const [, words] = at(robot.tasks, tick);
          const [, rounds, reached] = at(robot.progress, tick);
          const heading = robot.headings?.[tick] ?? null;
          const here = where?.(i, player.time) ?? { region: robot.path[tick]!, heading };
          const facing = here.heading ? `, facing ${DIRECTIONS[here.heading]}` : "";
          const role = roleOf(robot.name, frames);
          const transit = where ? null : transitAt(robot, tick);
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
                <RobotSign robot={robot} size={32} />
              </button>
              <div>
                <p>
                  <b>{robot.name}</b>{" "}
                  {robot.shape && (
                    <svg class="likeness" viewBox="-1.05 -1.05 2.1 2.1" aria-hidden="true">
                      <path d={robot.shape} fill-rule="evenodd" />
                    </svg>
                  )}
                  <span class="quiet model">{robot.model}</span>
                  {charge !== null && <Charge percent={charge} />}
                  {role && <span class={`role ${role[0]}`}>{role[1]}</span>}
                </p>
                <p class="objective">
                  {words}
                  <span class="quiet">
                    {reached >= 0 && ` · reached ${run.names[reached] ?? areaOf(run, reached) ?? reached}`}
                    {rounds > 0 && ` · ${rounds} ${rounds === 1 ? "round" : "rounds"}`}
                  </span>
                </p>
                <p class="quiet">
                  at {label(run, here.region).replace(", ", ",\u00a0")}
                  {onItsWay}
                  {facing}
                  {loads.length > 0 && ` · carries ${loads.map((load) => load.label).join(", ")}`}
                </p>
                {knowledgeOf(run, robot, tick).map((words) => (
                  <p class="quiet knowledge-of">{words}</p>
                ))}
              </div>
            </li>
          );
        })}
      </ul>
    </section>
  );
}

/** The charge of a battery in percent. */
function Charge({ percent }: { percent: number }) {
  return (
    <span class={`charge ${percent <= 20 ? "low" : ""}`} title="Charge of its battery">
      <span class="cell" aria-hidden="true">
        <span style={{ width: `${percent}%` }} />
      </span>
      {percent} %
    </span>
  );
}

/** Fade the last visible row if more follow, so that none seems cut. */
function fade(section: HTMLElement): void {
  const below = section.scrollHeight - section.clientHeight - section.scrollTop;
  section.classList.toggle("more", below > 1);
}

export function Stack({ run, tick }: PanelProps) {
  const frames = at(run.stack, tick)[1];
  return (
    <section class="panel stack" aria-labelledby="stack-title">
      <h2 id="stack-title">
        Objective stack <span class="count">{frames.length}</span>
      </h2>
      {frames.length === 0 && <p class="quiet">Empty: every robot follows its own objective.</p>}
      <ol reversed>
        {frames
          .map(([about, roles], i) => (
            <li key={i}>
              <b>{about}</b>
              <span class="quiet">{roles}</span>
            </li>
          ))
          .reverse()}
      </ol>
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
          if (tick < obstacle.since) return null;
          const status = at(obstacle.status, tick)[1];
          const need = status === "resolved" ? undefined : obstacle.needs[at(obstacle.met, tick)[1]];
          return (
            <li key={obstacle.name} data-obstacle={obstacle.name} data-status={status}>
              <StatusSign run={run} status={status} />
              <b>{obstacle.label}</b>
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

const UNORDERED = "not ordered yet";
const STATUSES: Status[] = ["hidden", "found", "requested", "resolved", "blocked"];

export const Legend = memo(({ run }: { run: Run }) => {
  const first = run.robots[0];
  const load = run.obstacles.find((obstacle) => obstacle.carried.length > 1);
  const unknown = `obstacle, still hidden${run.obstacles.some((each) => each.ordered) ? ", or " + UNORDERED : ""}`;
  return (
    <details class="legend" onKeyDown={(event) => event.key === "Escape" && (event.currentTarget.open = false)}>
      <summary>Legend</summary>
      <ul>
        <li>
          <svg width="18" height="18" aria-hidden="true">
            <rect class="walls" x="1" y="1" width="16" height="16" />
          </svg>
          wall
        </li>
        {STATUSES.map((status) => (
          <li key={status}>
            <StatusSign run={run} status={status} />
            {status === "hidden" ? unknown : run.marks.status[status].meaning}
          </li>
        ))}
        {first && (
          <li>
            <svg width="20" height="20" viewBox="-2 -2 24 24" aria-hidden="true">
              <path class="aim" style={{ "--colour": first.look.colour }} d={bracketsOf(0, 0, 20)} />
              <path class="target" transform="translate(14 6) scale(3.6)" d={first.look.path} fill={first.look.colour} />
            </svg>
            target of the robot with this shape and colour
          </li>
        )}
        {first && (
          <li>
            <svg width="30" height="18" aria-hidden="true" class="trail" style={{ "--colour": first.look.colour }}>
              <path d="M1 9h9" opacity="0.25" />
              <path d="M10 9h9" opacity="0.45" />
              <path d="M19 9h10" opacity="0.75" />
            </svg>
            path of a robot, newest part strongest
          </li>
        )}
        {first && run.robots.some((robot) => robot.tasks.some((task) => task[3].length > 0)) && (
          <li>
            <svg width="20" height="20" viewBox="-2 -2 24 24" aria-hidden="true">
              <path class="aim avoided" style={{ "--colour": first.look.colour }} d="M1 1h18v18h-18z" />
            </svg>
            regions that the robot of this colour avoids
          </li>
        )}
        {run.robots.some((robot) => robot.headings !== null) && (
          <li>
            <svg width="18" height="18" viewBox="-0.9 -2 1.8 1.2" aria-hidden="true">
              <path class="nose" d={run.nose} />
            </svg>
            where a robot faces
          </li>
        )}
        <ShadingLegend run={run} />
        {load && (
          <li>
            <svg width="18" height="18" viewBox="-1.2 -1.2 2.4 2.4" class="robot" aria-hidden="true">
              <g class="load">
                <rect x={-1.1} y={-1.1} width={2.2} height={2.2} style="stroke-width: 0.1" />
                <path d={load.shape || ANY_LOAD} fill-rule="evenodd" />
              </g>
            </svg>
            load that the robot carries
          </li>
        )}
        {run.exclusions.map(([robots], i) => (
          <li key={i}>
            <svg width="18" height="18" aria-hidden="true">
              <path class="exclusion" d="M2 2h14v14h-14z" />
            </svg>
            at most one of {robots.join(", ")} at a time
          </li>
        ))}
        {run.chargers.length > 0 && (
          <li>
            <svg width="18" height="18" viewBox="-1.2 -1.2 2.4 2.4" aria-hidden="true">
              <path class="charger" d={run.charger} />
            </svg>
            charger
          </li>
        )}
        <li>
          <svg width="26" height="18" viewBox="14 -9 24 18" aria-hidden="true">
            <path class="violation-arrow" d={ARROW} />
          </svg>
          refused step
        </li>
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
        <li>
          <svg width="22" height="10" aria-hidden="true">
            <path class="doing synthesis" d="M11 0v10" />
          </svg>
          synthesis, in its lane
        </li>
        {Object.keys(run.areas).length > 0 && (
          <li>
            <svg width="18" height="18" aria-hidden="true">
              <path class="area-line" d="M2 2h14v14h-14z" />
            </svg>
            area
          </li>
        )}
        <li>
          <svg width="10" height="14" class="goals" aria-hidden="true">
            <path d="M5 4v6" />
          </svg>
          goals, below the timeline
        </li>
      </ul>
    </details>
  );
});

/** Legend of the shadings in this run: robots in transit, sight, beliefs. */
function ShadingLegend({ run }: { run: Run }) {
  const moving = run.robots.find((robot) => robot.steps.length > 0);
  const seeing = viewersOf(run).find((robot) => robot.view!.sight.length > 0);
  const believing = viewersOf(run).find((robot) => robot.view!.beliefs.length > 0);
  const of = believing?.view!.beliefs[0]![0] ?? 0;
  const sought = { "--colour": run.robots[of]?.look.colour };
  return (
    <>
      {moving && (
        <li>
          <svg width="34" height="18" aria-hidden="true">
            <rect class="taken" style={{ "--colour": moving.look.colour }} x="1.5" y="1.5" width="31" height="15" rx="4" />
          </svg>
          in transit: occupies both regions
        </li>
      )}
      {seeing && (
        <li>
          <svg width="18" height="18" aria-hidden="true" class="sight" style={{ "--colour": seeing.look.colour }}>
            <path class="area" d="M1 1h16v16h-16z" />
            <path class="border" d="M1 1h16v16h-16z" />
          </svg>
          what {viewersOf(run).length > 1 ? "the robot of that colour" : seeing.name} sees
        </li>
      )}
      {believing && (
        <li>
          <svg width="18" height="18" aria-hidden="true" class="belief" style={sought}>
            <defs>
              <Hatch run={run} of={of} id="hatch-legend" />
            </defs>
            <path d="M1 1h16v16h-16z" fill="url(#hatch-legend)" />
            <path class="border" d="M1 1h16v16h-16z" />
          </svg>
          where the robot of that colour may be, by the last observation
        </li>
      )}
      {believing && (
        <li>
          <svg width="18" height="18" aria-hidden="true" class="belief seen" style={sought}>
            <path class="border" d="M2 2h14v14h-14z" />
          </svg>
          where it was seen
        </li>
      )}
    </>
  );
}
