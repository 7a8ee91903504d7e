/** The stage of the 3D page: the scene on a canvas, and the controls of the camera and the walls. */

import { useLayoutEffect, useReducer, useRef, useState } from "preact/hooks";
import { when, type Run } from "../run/run";
import { resized } from "../listening";
import { calm } from "../settings";
import type { Choice, Stage, StageProps, Whereabouts } from "../map/stage";
import { OrbitEye } from "./eye";
import { SolidMarks } from "./legend";
import { sampleAt, type Motion, type Sampled } from "./motion";
import { RunScene } from "./scene";

const CHOICES: Choice[] = [
  ["numbers", "reserved regions"],
  ["names", "names"],
  ["trails", "footprints and paths"],
  ["targets", "targets"],
  ["hidden", "hidden obstacles"],
];

/** Half seconds, if the user prefers reduced motion. */
const CALM_STEPS = 2;

export function stage3d(run: Run, motion: Motion, robots: Sampled[]): Stage {
  const eye = new OrbitEye();
  const View = (props: StageProps) => <Scene {...props} motion={motion} robots={robots} eye={eye} />;
  const where = (robot: number, seconds: number): Whereabouts => {
    const { x, y, yaw } = sampleAt(motion, robots[robot]!, seconds);
    const [col, row] = [Math.floor(x! / motion.side), run.rows - 1 - Math.floor(y! / motion.side)];
    const heading = run.robots[robot]!.headings === null ? null : "ENWS"[Math.round((yaw ?? 0) / (Math.PI / 2)) & 3]!;
    return { region: row * run.cols + col, heading };
  };
  const Marks = ({ run }: { run: Run }) => <SolidMarks run={run} robots={robots} />;
  return { View, Marks, eye, choices: CHOICES, where };
}

interface SceneProps extends StageProps {
  motion: Motion;
  robots: Sampled[];
  eye: OrbitEye;
}

function Scene({ run, player, tick, shown, theme, motion, robots, eye }: SceneProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const scene = useRef<RunScene | null>(null);
  const latest = useRef(shown);
  latest.current = shown;
  const [failed, setFailed] = useState(false);
  const draw = (): void => {
    const seconds = calm.matches ? Math.floor(player.time * CALM_STEPS) / CALM_STEPS : player.time;
    scene.current?.update(seconds, player.tick, latest.current);
  };
  useLayoutEffect(() => {
    let made: RunScene;
    try {
      made = scene.current = new RunScene(canvas.current!, run, motion, robots);
    } catch {
      setFailed(true);
      return;
    }
    eye.attach(made);
    const room = canvas.current!.parentElement!;
    const fit = (): void => {
      made.resize(room.clientWidth, room.clientHeight);
      draw();
    };
    // Dragging the camera redraws the scene also while the run is paused, once per frame.
    let frame = 0;
    const touched = (): void => {
      cancelAnimationFrame(frame);
      frame = requestAnimationFrame(draw);
    };
    const stops = [resized(room, fit), player.onFrame(draw), eye.onChange(touched), made.onTouch(touched)];
    return () => {
      eye.attach(null);
      for (const stop of stops) stop();
      cancelAnimationFrame(frame);
      made.dispose();
    };
  }, [run, player, eye]);
  useLayoutEffect(() => {
    scene.current?.recolour();
    draw();
  }, [theme]);
  useLayoutEffect(draw, [shown, tick]);
  return (
    <div class="stage3d">
      <canvas ref={canvas} role="img" aria-label={`The run in three dimensions, ${when(run, tick)}`} />
      {failed && <p class="failure">This browser shows no 3D graphics (WebGL). The flat page shows the same run.</p>}
      <Tools run={run} eye={eye} />
    </div>
  );
}

function Tools({ run, eye }: { run: Run; eye: OrbitEye }) {
  const [, redraw] = useReducer((count: number) => count + 1, 0);
  useLayoutEffect(() => eye.onChange(() => redraw(0)), [eye]);
  return (
    <div class="cameras card row" role="group" aria-label="View of the scene">
      <select
        aria-label="Camera"
        value={String(eye.view)}
        onChange={({ currentTarget: { value } }) =>
          eye.choose(value === "orbit" || value === "top" || value === "story" ? value : Number(value))
        }
      >
        <option value="orbit">around the map</option>
        <option value="top">from above</option>
        <option value="story">follow the story</option>
        {run.robots.map((robot, i) => (
          <option value={String(i)}>follow {robot.name}</option>
        ))}
      </select>
    </div>
  );
}
