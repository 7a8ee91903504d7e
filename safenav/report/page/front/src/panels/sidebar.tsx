/** The side of the page: robots with their objectives, the stack, the obstacles. */

import { useLayoutEffect, useReducer } from "preact/hooks";
import type { Eye } from "../map/camera";
import type { Stage } from "../map/stage";
import type { Player } from "../run/player";
import { RobotSign, StatusSign } from "./icons";
import { areaOf, at, label, loadsOf, roleOf, transitAt, UNORDERED, type Run } from "../run/run";
import { knowledgeOf } from "../map/shading";

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
  return (
    <section class="panel robots" aria-labelledby="robots-title">
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
                <RobotSign robot={robot} size={22} />
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
    <span class="charge" title="Charge of its battery">
      <meter min={0} max={100} low={20} value={percent} /> {percent} %
    </span>
  );
}

export function Stack({ run, tick }: PanelProps) {
  const frames = at(run.stack, tick)[1];
  if (frames.length === 0) return null;
  return (
    <section class="panel stack" aria-labelledby="stack-title">
      <h2 id="stack-title">
        Objective stack <span class="count">{frames.length}</span>
      </h2>
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
          const status = at(obstacle.status, tick)[1];
          if (status === "absent") return null;
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
