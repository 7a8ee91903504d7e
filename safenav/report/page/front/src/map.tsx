/**
 * The map, in drawings over one another so that a browser repaints only what changes: the floor
 * (never), shading of what robots see and believe (at ticks), trails (every frame), what is known
 * (at ticks), robots (every frame). What moves in every frame is moved by hand and not through
 * the component tree.
 */

import { memo } from "preact/compat";
import { useLayoutEffect, useRef } from "preact/hooks";
import type { Player } from "./player";
import { at, eventsAt, label, poseAt, separate, transitAt, type Pose, type Robot, type Run } from "./run";
import { calm, type Shown } from "./settings";
import { shadesAt, Shading, viewersOf } from "./shading";

const CELL = 40;
/** From the nose of a robot to the sign in the next region. */
export const ARROW = "M20.5 0H29M24.5 -4.5L29.5 0L24.5 4.5";
const BODY = 0.28 * CELL;
const TRAIL = 24;
const STRENGTHS = [0.25, 0.45, 0.75];

interface MapProps {
  run: Run;
  player: Player;
  tick: number;
  shown: Shown;
}

export function MapView({ run, player, tick, shown }: MapProps) {
  const width = run.cols * CELL;
  const height = run.rows * CELL;
  const box = `-2 -2 ${width + 4} ${height + 4}`;
  const readout = useRef<HTMLParagraphElement>(null);
  const point = (event: PointerEvent): void => {
    const frame = (event.currentTarget as HTMLElement).getBoundingClientRect();
    const scale = frame.width / (width + 4);
    const col = Math.floor(((event.clientX - frame.left) / scale - 2) / CELL);
    const row = Math.floor(((event.clientY - frame.top) / scale - 2) / CELL);
    const inside = row >= 0 && col >= 0 && row < run.rows && col < run.cols;
    const region = row * run.cols + col;
    readout.current!.textContent = inside ? describeRegion(run, region, player.tick, shown) : "";
  };
  const ratio = `${width + 4} / ${height + 4}`;
  return (
    <div class="map-room">
      <div
        class="map"
        role="img"
        aria-label={describeMap(run, tick)}
        style={{ aspectRatio: ratio, "--ratio": (width + 4) / (height + 4) }}
        onPointerMove={point}
        onPointerLeave={() => (readout.current!.textContent = "")}
      >
        <svg viewBox={box} class="floor">
          <Floor run={run} numbers={shown.numbers} />
        </svg>
        {viewersOf(run).length > 0 && (
          <svg viewBox={box} class="shading">
            <Shading run={run} tick={tick} shown={shown} cell={CELL} />
          </svg>
        )}
        <svg viewBox={box} class="trails">
          {shown.trails && <Trails run={run} player={player} />}
        </svg>
        <svg viewBox={box} class="knowledge">
          <Knowledge run={run} tick={tick} shown={shown} />
        </svg>
        <svg viewBox={box} class="motion">
          <Robots run={run} player={player} />
        </svg>
      </div>
      <p class="readout" ref={readout} aria-hidden="true" />
    </div>
  );
}

function describeMap(run: Run, tick: number): string {
  const robots = run.robots.map((robot) => `${robot.name} in region ${label(run, robot.path[tick]!)}`);
  const obstacles = run.obstacles.map((o) => `${o.name} ${at(o.status, tick)[1]}`);
  return `Map of ${run.rows} by ${run.cols} regions at tick ${tick}. ${robots.join(", ")}. ${obstacles.join(", ")}`;
}

function describeRegion(run: Run, region: number, tick: number, shown: Shown): string {
  const parts = [`region ${label(run, region)}`];
  if (isWall(run, region)) parts.push("wall");
  for (const robot of run.robots) {
    if (robot.path[tick] === region) parts.push(robot.name);
    if (transitAt(robot, tick)?.[0] === region) parts.push(`${robot.name} is on its way here`);
    if (at(robot.tasks, tick)[2].includes(region)) parts.push(`target of ${robot.name}`);
  }
  for (const o of run.obstacles) if (o.region === region) parts.push(`${o.name}, ${at(o.status, tick)[1]}`);
  parts.push(...shadesAt(run, region, tick, shown));
  return parts.join(" · ");
}

function isWall(run: Run, region: number): boolean {
  return run.grid[Math.floor(region / run.cols)]![region % run.cols] === "#";
}

const Floor = memo(({ run, numbers }: { run: Run; numbers: boolean }) => {
  const width = run.cols * CELL;
  const height = run.rows * CELL;
  const lines: string[] = [];
  for (let r = 1; r < run.rows; r++) lines.push(`M0 ${r * CELL}H${width}`);
  for (let c = 1; c < run.cols; c++) lines.push(`M${c * CELL} 0V${height}`);
  const walls: string[] = [];
  const labels = [];
  for (let row = 0; row < run.rows; row++) {
    for (let col = 0; col < run.cols; col++) {
      const region = row * run.cols + col;
      if (isWall(run, region)) {
        let end = col;
        while (end + 1 < run.cols && isWall(run, row * run.cols + end + 1)) end++;
        walls.push(`M${col * CELL} ${row * CELL}h${(end - col + 1) * CELL}v${CELL}h${(col - end - 1) * CELL}z`);
        col = end;
      } else if (numbers) {
        labels.push(
          <text x={col * CELL + 2.8} y={row * CELL + 8}>
            {region}
          </text>,
        );
      }
    }
  }
  return (
    <>
      <rect class="ground" width={width} height={height} />
      <path class="lines" d={lines.join("")} />
      <path class="walls" d={walls.join("")} />
      <g class="numbers">{labels}</g>
    </>
  );
});

const Knowledge = memo(({ run, tick, shown }: { run: Run; tick: number; shown: Shown }) => (
  <>
    {run.obstacles.map((obstacle) => {
      const status = at(obstacle.status, tick)[1];
      if (status === "hidden" && !shown.hidden) return null;
      const x = (obstacle.region % run.cols) * CELL;
      const y = Math.floor(obstacle.region / run.cols) * CELL;
      return (
        <g
          key={obstacle.name}
          class={`obstacle status-${status}`}
          data-obstacle={obstacle.name}
          data-status={status}
          transform={`translate(${x} ${y})`}
        >
          <rect x={1.2} y={1.2} width={CELL - 2.4} height={CELL - 2.4} rx={3.5} />
          <path
            transform={`translate(${CELL / 2} ${CELL / 2}) scale(${status === "hidden" ? 6 : 8.8})`}
            d={run.marks.status[status].path}
            fill-rule="evenodd"
          />
        </g>
      );
    })}
    <Taken run={run} tick={tick} />
    {shown.targets && <Targets run={run} tick={tick} />}
    <Violations run={run} tick={tick} />
  </>
));

/** Around both regions that a robot takes up while a step takes it several ticks. */
function Taken({ run, tick }: { run: Run; tick: number }) {
  return (
    <>
      {run.robots.map((robot) => {
        const transit = transitAt(robot, tick);
        if (transit === null) return null;
        const regions = [robot.path[tick]!, transit[0]];
        const cols = regions.map((region) => region % run.cols);
        const rows = regions.map((region) => Math.floor(region / run.cols));
        return (
          <rect
            class="taken"
            data-robot={robot.name}
            style={{ "--colour": robot.look.colour }}
            x={Math.min(...cols) * CELL + 2.5}
            y={Math.min(...rows) * CELL + 2.5}
            width={(Math.abs(cols[0]! - cols[1]!) + 1) * CELL - 5}
            height={(Math.abs(rows[0]! - rows[1]!) + 1) * CELL - 5}
            rx={8}
          />
        );
      })}
    </>
  );
}

/** A small copy of the robot's shape in a corner of each region that it is to reach. */
function Targets({ run, tick }: { run: Run; tick: number }) {
  const corners = [
    [0.86, 0.86],
    [0.14, 0.86],
    [0.86, 0.14],
  ];
  const taken = new Map<number, number>();
  return (
    <>
      {run.robots.flatMap((robot) =>
        at(robot.tasks, tick)[2].map((region) => {
          const slot = taken.get(region) ?? 0;
          taken.set(region, slot + 1);
          const corner = corners[slot];
          if (!corner) return null;
          const x = ((region % run.cols) + corner[0]!) * CELL;
          const y = (Math.floor(region / run.cols) + corner[1]!) * CELL;
          const place = `translate(${x} ${y}) scale(3.6)`;
          return <path class="target" d={robot.look.path} fill={robot.look.colour} transform={place} />;
        }),
      )}
    </>
  );
}

/** An arrow from a robot into the region that it would have entered. */
function Violations({ run, tick }: { run: Run; tick: number }) {
  const met = eventsAt(run, tick).filter((e) => e[1] === "violation" && e[3] >= 0 && e[4] >= 0);
  return (
    <>
      {met.map(([, , , robot, region]) => {
        const from = run.robots[robot]!.path[tick]!;
        const dx = (region % run.cols) - (from % run.cols);
        const dy = Math.floor(region / run.cols) - Math.floor(from / run.cols);
        const x = ((from % run.cols) + 0.5) * CELL;
        const y = (Math.floor(from / run.cols) + 0.5) * CELL;
        const angle = (Math.atan2(dy, dx) * 180) / Math.PI;
        return (
          <path
            class="violation-arrow"
            transform={`translate(${x} ${y}) rotate(${angle})`}
            d={ARROW}
          />
        );
      })}
    </>
  );
}

function Robots({ run, player }: { run: Run; player: Player }) {
  const root = useRef<SVGGElement>(null);
  useLayoutEffect(() => {
    const robots = [...root.current!.children];
    const noses = robots.map((robot) => robot.querySelector(".nose"));
    return onMoment(player, (moment) => {
      separate(run.robots.map((robot) => poseAt(run, robot, moment))).forEach((pose, i) => {
        robots[i]!.setAttribute("transform", `translate(${centre(pose.x)} ${centre(pose.y)})`);
        noses[i]?.setAttribute("transform", `rotate(${pose.heading ?? 0}) scale(${0.92 * BODY})`);
      });
    });
  }, [run, player]);
  return (
    <g ref={root}>
      {run.robots.map(({ name, headings, look }) => (
        <g class="robot" key={name} data-robot={name}>
          {headings !== null && <path class="nose" d={run.nose} />}
          <path class="body" d={look.path} fill={look.colour} transform={`scale(${BODY})`} />
          <text class="letters" y={look.drop * BODY} font-size={look.size * BODY} fill={look.ink}>
            {look.letters}
          </text>
        </g>
      ))}
    </g>
  );
}

function Trails({ run, player }: { run: Run; player: Player }) {
  const root = useRef<SVGGElement>(null);
  useLayoutEffect(() => {
    const paths = [...root.current!.children].map((trail) => [...trail.querySelectorAll("path")]);
    const lane = Math.min(0.09, 0.5 / Math.max(1, run.robots.length)) * CELL;
    let drawn = -1;
    return onMoment(player, (moment) => {
      const tick = Math.floor(moment);
      run.robots.forEach((robot, i) => {
        const shift = (i - (run.robots.length - 1) / 2) * lane + CELL / 2;
        drawTrail(run, robot, tick, poseAt(run, robot, moment), shift, paths[i]!, tick !== drawn);
      });
      drawn = tick;
    });
  }, [run, player]);
  return (
    <g ref={root}>
      {run.robots.map((robot) => (
        <g class="trail" key={robot.name} style={{ "--colour": robot.look.colour }}>
          {STRENGTHS.map((opacity) => (
            <path opacity={opacity} />
          ))}
        </g>
      ))}
    </g>
  );
}

/** Draws now and with every frame; in whole ticks for those who want less motion. */
function onMoment(player: Player, draw: (moment: number) => void): () => void {
  const follow = (time: number): void => draw(calm.matches ? Math.floor(time + 1e-9) : time);
  follow(player.time);
  return player.onFrame(follow);
}

function centre(cells: number): string {
  return ((cells + 0.5) * CELL).toFixed(2);
}

/**
 * The way of the last ticks in three strengths. The two older parts change with ticks only; the
 * newest ends at the robot and changes with every frame.
 */
function drawTrail(
  run: Run,
  robot: Robot,
  tick: number,
  pose: Pose,
  lane: number,
  paths: SVGPathElement[],
  whole: boolean,
): void {
  const start = Math.max(0, tick - TRAIL);
  const length = tick - start;
  for (let part = whole ? 0 : 2; part < 3; part++) {
    const from = start + Math.floor((length * part) / 3);
    const to = start + Math.floor((length * (part + 1)) / 3);
    let data = "";
    let before = -1;
    for (let t = from; t <= to; t++) {
      const region = robot.path[t]!;
      if (region === before) continue;
      before = region;
      const x = (region % run.cols) * CELL + lane;
      const y = Math.floor(region / run.cols) * CELL + lane;
      data += `${data ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`;
    }
    if (part === 2) data += `L${(pose.x * CELL + lane).toFixed(1)} ${(pose.y * CELL + lane).toFixed(1)}`;
    paths[part]!.setAttribute("d", data);
  }
}
