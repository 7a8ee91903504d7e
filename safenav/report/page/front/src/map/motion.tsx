/** Robots, which move with every frame without rendering components. */

import { useLayoutEffect, useRef } from "preact/hooks";
import { CELL, type Camera } from "./camera";
import { INK } from "./shapes";
import type { Player } from "../run/player";
import { at, loadsOf, poseAt, type Run, separate, tickAt } from "../run/run";

const BODY = 0.28 * CELL;
/** A badge beside the body: the place and the radius of its plate. */
const BADGE = { at: 0.96 * BODY, radius: 0.7 * BODY, shape: 0.6 * BODY };
/** The least radius of a robot, in pixels. */
const LEAST = 8.5;

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
    const [loads, pauses] = [".load", ".out"].map((badge) => robots.map((robot) => robot.querySelector(badge)!)) as [Element[], Element[]];
    const draw = (moment: number): void => {
      const tick = tickAt(run, moment);
      pauses.forEach((sign, i) => sign.setAttribute("visibility", at(run.robots[i]!.out, tick)[1] ? "visible" : "hidden"));
      loads.forEach((sign, i) => {
        const [load] = loadsOf(run, i, tick);
        sign.setAttribute("visibility", load ? "visible" : "hidden");
        if (load) sign.querySelector("path")!.setAttribute("d", load.shape || run.marks.load);
      });
      const grown = growth(camera, BODY, LEAST);
      const scale = grown === 1 ? "" : ` scale(${grown.toFixed(3)})`;
      separate(run.robots.map((robot) => poseAt(run, robot, moment))).forEach((pose, i) => {
        if (camera.followed === i) camera.track(pose.x, pose.y);
        robots[i]!.setAttribute("transform", `translate(${centre(pose.x)} ${centre(pose.y)})${scale}`);
        noses[i]?.setAttribute("transform", `rotate(${pose.heading ?? 0}) scale(${0.92 * BODY})`);
      });
    };
    draw(player.time);
    const stops = [player.onFrame(draw), camera.onChange(() => draw(player.time))];
    return () => stops.forEach((stop) => stop());
  }, [run, player, camera]);
  return (
    <g ref={root}>
      {run.robots.map(({ name, headings, look }) => (
        <g class="robot" key={name} data-robot={name}>
          {headings !== null && <path class="nose" {...INK.nose} d={run.nose} />}
          <path class="body" {...INK.body} d={look.path} fill={look.colour} transform={`scale(${BODY})`} />
          <text {...INK.letters} y={look.drop * BODY} font-size={look.size * BODY} fill={look.ink}>
            {look.letters}
          </text>
          {["load", "out"].map((kind) => (
            <g class={kind} key={kind} transform={`translate(${kind === "load" ? -BADGE.at : BADGE.at} ${-BADGE.at})`} visibility="hidden">
              <rect x={-BADGE.radius} y={-BADGE.radius} width={2 * BADGE.radius} height={2 * BADGE.radius} rx={2} {...INK.plate} stroke-width={0.8} />
              <path transform={`scale(${BADGE.shape})`} {...INK.shape} d={run.marks.event.service} />
            </g>
          ))}
        </g>
      ))}
    </g>
  );
}

function centre(cells: number): string {
  return ((cells + 0.5) * CELL).toFixed(2);
}
