/** Robots and their trails, which move with every frame without rendering components. */

import { useLayoutEffect, useRef } from "preact/hooks";
import { CELL, type Camera } from "./camera";
import { INK } from "./shapes";
import type { Player } from "../run/player";
import { calm, loadsOf, type Obstacle, placeOf, type Pose, poseAt, type Robot, type Run, separate, tickAt } from "../run/run";

const BODY = 0.28 * CELL;
/** The silhouette of the model beside the body: the place and the radius of its plate. */
const BADGE = { at: 0.96 * BODY, radius: 0.7 * BODY, shape: 0.6 * BODY };
/** The least radius of a robot, in pixels. */
const LEAST = 8.5;
const TRAIL = 24;
const STRENGTHS = [0.25, 0.45, 0.75];

interface MotionProps {
  run: Run;
  player: Player;
  camera: Camera;
}

/** Return the enlargement that keeps a mark legible on maps of any size. */
export function growth(camera: Camera, radius: number, least: number): number {
  return Math.max(1, (least * CELL) / (radius * camera.scale));
}

export function Robots({ run, player, camera }: MotionProps) {
  const root = useRef<SVGGElement>(null);
  useLayoutEffect(() => {
    const robots = [...root.current!.children];
    const noses = robots.map((robot) => robot.querySelector(".nose"));
    const loads = robots.map((robot) => robot.querySelector(".load")!);
    let drawn = -1;
    const draw = (moment: number): void => {
      const tick = tickAt(run, moment);
      if (tick !== drawn) loads.forEach((load, i) => showLoads(load, loadsOf(run, i, tick), run.marks.load));
      drawn = tick;
      const grown = growth(camera, BODY, LEAST);
      const scale = grown === 1 ? "" : ` scale(${grown.toFixed(3)})`;
      separate(run.robots.map((robot) => poseAt(run, robot, moment))).forEach((pose, i) => {
        if (camera.followed === i) camera.track(pose.x, pose.y);
        robots[i]!.setAttribute("transform", `translate(${centre(pose.x)} ${centre(pose.y)})${scale}`);
        noses[i]?.setAttribute("transform", `rotate(${pose.heading ?? 0}) scale(${0.92 * BODY})`);
      });
    };
    const stops = [onMoment(player, draw), camera.onChange(() => draw(momentOf(player)))];
    return () => stops.forEach((stop) => stop());
  }, [run, player, camera]);
  return (
    <g ref={root}>
      {run.robots.map(({ name, headings, look, shape }) => (
        <g class="robot" key={name} data-robot={name}>
          {headings !== null && <path class="nose" {...INK.nose} d={run.nose} />}
          <path class="body" {...INK.body} d={look.path} fill={look.colour} transform={`scale(${BODY})`} />
          <text {...INK.letters} y={look.drop * BODY} font-size={look.size * BODY} fill={look.ink}>
            {look.letters}
          </text>
          {shape && (
            <g class="shape" transform={`translate(${BADGE.at} ${BADGE.at})`}>
              <circle r={BADGE.radius} {...INK.ground} />
              <path transform={`scale(${BADGE.shape})`} d={shape} {...INK.shape} />
            </g>
          )}
          <g class="load" transform={`translate(${-BADGE.at} ${-BADGE.at})`} visibility="hidden">
            <rect x={-BADGE.radius} y={-BADGE.radius} width={2 * BADGE.radius} height={2 * BADGE.radius} rx={2} {...INK.plate} stroke-width={0.8} />
            <path transform={`scale(${BADGE.shape})`} {...INK.shape} />
            <text y={-BADGE.radius * 1.15} {...INK.order} font-size={8} />
          </g>
        </g>
      ))}
    </g>
  );
}

export function Trails({ run, player }: { run: Run; player: Player }) {
  const root = useRef<SVGGElement>(null);
  useLayoutEffect(() => {
    const paths = [...root.current!.children].map((trail) => [...trail.querySelectorAll("path")]);
    const lane = Math.min(0.09, 0.5 / Math.max(1, run.robots.length)) * CELL;
    let drawn = -1;
    return onMoment(player, (moment) => {
      const tick = tickAt(run, moment);
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
        <g class="trail" {...INK.trail} key={robot.name} style={{ "--colour": robot.look.colour }}>
          {STRENGTHS.map((opacity) => (
            <path {...INK.trailPart} opacity={opacity} />
          ))}
        </g>
      ))}
    </g>
  );
}

/** Show the first load that a robot carries, and their number. */
function showLoads(sign: Element, loads: Obstacle[], any: string): void {
  sign.setAttribute("visibility", loads.length ? "visible" : "hidden");
  if (loads.length === 0) return;
  sign.querySelector("path")!.setAttribute("d", loads[0]!.shape || any);
  sign.querySelector("text")!.textContent = loads.length > 1 ? `${loads.length} x` : "";
}

/** Draw now and with every frame; only whole ticks if the user prefers reduced motion. */
function onMoment(player: Player, draw: (moment: number) => void): () => void {
  draw(momentOf(player));
  return player.onFrame(() => draw(momentOf(player)));
}

function momentOf(player: Player): number {
  return calm.matches ? Math.floor(player.time + 1e-9) : player.time;
}

function centre(cells: number): string {
  return ((cells + 0.5) * CELL).toFixed(2);
}

/**
 * Draw the path of the last ticks in three strengths. The two older parts change with ticks only; the
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
  const start = Math.max(0, tick - TRAIL * (run.times ? run.robots.length : 1));
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
      const place = placeOf(run, region).map((at) => (at * CELL + lane).toFixed(1));
      data += (data ? "L" : "M") + place.join(" ");
    }
    if (part === 2) data += `L${(pose.x * CELL + lane).toFixed(1)} ${(pose.y * CELL + lane).toFixed(1)}`;
    paths[part]!.setAttribute("d", data);
  }
}
