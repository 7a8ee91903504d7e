/**
 * The map, in drawings over one another so that a browser repaints only what changes: the floor
 * (never), shading of what robots believe (at ticks), obstacles and targets (at ticks), robots (every
 * frame). Motion per frame bypasses the component tree.
 */

import type { ComponentChildren, ComponentType } from "preact";
import { useLayoutEffect, useRef } from "preact/hooks";
import { Button, resized } from "../panels/shell";
import type { Player } from "../run/player";
import { at, isWall, label, placeOf, poseAt, type Run, transitAt, useRedraw, when } from "../run/run";
import { Camera, CELL, type Extent, type Eye } from "./camera";
import { type Hand, listenToPointers, useCursor } from "./cursor";
import { Floor, Names, useNames } from "./floor";
import { Knowledge, Shading, viewersOf } from "./knowledge";
import { growth, Robots } from "./motion";
import { INK } from "./shapes";

interface MapProps {
  run: Run;
  player: Player;
  camera: Camera;
  tick: number;
  /** The region that the words below the map are about, -1 for none. */
  spoken?: number;
  hand?: Hand | undefined;
}

export function MapView({ run, player, camera, tick, spoken = -1, hand }: MapProps) {
  const redraw = useRedraw();
  const room = useRef<HTMLDivElement>(null);
  const shades = run.last > 0 && viewersOf(run).length > 0; // before a run nothing is seen
  const names = useNames(run, camera.scale);
  const now = useRef({ run, hand });
  now.current = { run, hand };
  const { cols, rows } = run;
  const first = run.robots[0]?.path[0] ?? cols + 1;
  const cursor = useCursor({ room, camera, cols, rows, first, hand }); // hears before the hand does
  useLayoutEffect(() => {
    const element = room.current!;
    const attach = (): void =>
      camera.attach([...element.querySelectorAll("svg")], element.clientWidth, element.clientHeight);
    const stops = [
      resized(element, attach),
      camera.onChange(redraw),
      listenToPointers(element, camera, () => now.current.hand, (x, y) => {
        const robot = robotAt(now.current.run, player, x, y, growth(camera, 11, 9) * 0.3);
        if (robot !== null) camera.follow(robot === camera.followed ? null : robot);
      }),
    ];
    attach();
    return () => stops.forEach((stop) => stop());
  }, [player, camera, shades, hand !== undefined]);
  return (
    <div class="map-room">
      <div
        ref={room}
        class={camera.isWhole ? "map" : "map near"}
        role="img"
        aria-label={describeMap(run, tick)}
        style={{ "--ratio": camera.ratio, "--free": 1 - camera.wall, ...(hand && { cursor: hand.cursor }) }}
        {...cursor.keys}
      >
        <svg class="floor">
          <Floor run={run} names={names} scale={camera.scale} />
        </svg>
        {shades && (
          <svg class="shading">
            <Shading run={run} tick={tick} selected={camera.followed} />
          </svg>
        )}
        <svg class="knowledge">
          <Knowledge run={run} tick={tick} grown={growth(camera, 8.8, 6)} />
          {spoken >= 0 && <Spoken run={run} region={spoken} />}
        </svg>
        <svg class="words">
          <Names names={names} scale={camera.scale} />
        </svg>
        <svg class="motion">
          <Robots run={run} player={player} camera={camera} />
        </svg>
        {hand && (
          <svg class="over">
            {hand.over}
            {cursor.mark}
          </svg>
        )}
      </div>
      <p class="readout" aria-live={cursor.mark ? "polite" : "off"}>
        {cursor.pointed >= 0 && describeRegion(run, cursor.pointed, tick)}
      </p>
    </div>
  );
}

/** A frame around the region that the words below the map are about. */
export function Spoken({ run, region }: { run: Run; region: number }) {
  const [col, row] = placeOf(run, region);
  return <rect {...INK.spoken} data-spoken={region} x={col * CELL + 2.5} y={row * CELL + 2.5} width={CELL - 5} height={CELL - 5} rx={2} />;
}

/** Return the nearest robot that is drawn at a point. */
function robotAt(run: Run, player: Player, x: number, y: number, reach: number): number | null {
  let found: number | null = null;
  let nearest = Math.max(0.5, reach);
  run.robots.forEach((robot, i) => {
    const pose = poseAt(run, robot, player.time);
    const away = Math.hypot(pose.x + 0.5 - x, pose.y + 0.5 - y);
    if (away < nearest) [found, nearest] = [i, away];
  });
  return found;
}

function describeMap(run: Run, tick: number): string {
  const robots = run.robots.map((robot) => `${robot.name} in region ${label(run, robot.path[tick]!)}`);
  const obstacles = run.obstacles.filter((o) => at(o.status, tick)[1] !== "absent").map((o) => `${o.name} ${at(o.status, tick)[1]}`);
  return `Map of ${run.rows} by ${run.cols} regions at ${when(run, tick)}. ${robots.join(", ")}. ${obstacles.join(", ")}`;
}

function describeRegion(run: Run, region: number, tick: number): string {
  const parts = [`region ${label(run, region)}`];
  if (isWall(run, region)) parts.push("wall");
  for (const robot of run.robots) {
    if (robot.path[tick] === region) parts.push(robot.name);
    if (transitAt(robot, tick)?.[2] === region) parts.push(`${robot.name} is in transit to this region`);
    if (at(robot.tasks, tick)[2].includes(region)) parts.push(`target of ${robot.name}`);
  }
  for (const o of run.obstacles) {
    const status = at(o.status, tick)[1];
    if (o.region === region && status !== "absent") parts.push(`${o.label}, ${status}`);
  }
  return parts.join(" · ");
}

export interface StageProps {
  run: Run;
  player: Player;
  tick: number;
  /** The region that the story is about now, -1 for none. */
  spoken: number;
  /** The hand that takes presses on the map instead of moving it. */
  hand?: Hand | undefined;
}

export interface Stage {
  View: ComponentType<StageProps>;
  /** Its buttons, unless they stand in the view. */
  Tools?: ComponentType;
  /** Rows of the legend for what it alone draws. */
  marks?: ComponentChildren;
  eye: Eye;
}

/** The flat map with its tools. */
export function flatStage(extent: Extent): Stage {
  const camera = new Camera(extent);
  return { View: (props) => <MapView {...props} camera={camera} />, Tools: () => <Zoom camera={camera} />, eye: camera };
}

/** The zoom of the map. */
export function Zoom({ camera }: { camera: Camera }) {
  const redraw = useRedraw();
  useLayoutEffect(() => camera.onChange(redraw), [camera]);
  const off = camera.isWhole && "the whole map is shown";
  return (
    <div class="tools row" role="group" aria-label="View of the map">
      <Button icon="minus" label="Zoom out" off={off} act={() => camera.zoom(1 / 1.5)} />
      <Button icon="plus" label="Zoom in" act={() => camera.zoom(1.5)} />
      <Button icon="fit" label="Whole map" off={off} act={() => camera.fit()} />
    </div>
  );
}
