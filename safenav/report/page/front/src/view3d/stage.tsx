/** The stage of a run with its motion: the scene, and the drawing of the flat map that lies on its floor. */

import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { dark, type Run, useRedraw, when } from "../run/run";
import { heard, resized } from "../panels/shell";
import { CELL } from "../map/camera";
import { Floor, Names, useNames } from "../map/floor";
import { Knowledge, Shading } from "../map/knowledge";
import { Spoken, type Stage, type StageProps } from "../map/map";
import { Row } from "../panels/legend";
import { decoded, type Motion } from "./motion";
import { RunScene, type View } from "./scene";

/** The part of a region that a wall in front of it hides. */
const BEHIND = 0.1;

/** The stage; an error where the browser has no WebGL. */
export async function stage3d(run: Run, motion: Motion): Promise<Stage> {
  const robots = await decoded(motion);
  const scene = new RunScene(run, motion, robots);
  const { colour } = run.robots[0]!.look;
  return {
    View: (props) => <SceneView {...props} scene={scene} />,
    Tools: () => <Cameras scene={scene} />,
    eye: scene,
    marks: (
      <Row words="footprints" shown={robots.some(({ track }) => track.feet.length > 0)} width={30}>
        <path fill={colour} opacity="0.5" d="M1 3h8v4h-8zM11 11h8v4h-8zM21 3h8v4h-8z" />
      </Row>
    ),
  };
}

function SceneView({ run, player, tick, spoken, scene }: StageProps & { scene: RunScene }) {
  const redraw = useRedraw();
  const room = useRef<HTMLDivElement>(null);
  const map = useRef<SVGSVGElement>(null);
  const scale = (room.current?.clientWidth ?? 800) / run.cols;
  const names = useNames(run, scale);
  useLayoutEffect(() => {
    const canvas = scene.renderer.domElement;
    room.current!.prepend(canvas, scene.words.domElement);
    const draw = (): void => scene.update(player.time, player.tick);
    const fit = (): void => {
      scene.resize(room.current!.clientWidth, room.current!.clientHeight);
      redraw();
      draw();
    };
    // Once per frame: a dragged camera redraws the scene also while the run is paused.
    let frame = 0;
    const changed = (): void => {
      cancelAnimationFrame(frame);
      frame = requestAnimationFrame(draw);
    };
    const stops = [resized(room.current!, fit), player.onFrame(draw), scene.onChange(changed)];
    return () => stops.forEach((stop) => stop());
  }, [run, player, scene]);
  useLayoutEffect(() => {
    const paint = (): void => scene.paint(map.current!, scale);
    paint();
    return heard(dark, { change: paint });
  }, [run, tick, scale, scene.followed]);
  return (
    <div class="stage3d" ref={room} role="img" aria-label={`The run in three dimensions, ${when(run, tick)}`}>
      <svg class="floor-map" ref={map}>
        <Floor run={run} names={names} scale={scale} />
        <Shading run={run} tick={tick} selected={scene.followed} />
        <Knowledge run={run} tick={tick} grown={1} />
        {spoken >= 0 && <Spoken run={run} region={spoken} />}
        <g transform={`translate(0 ${-BEHIND * CELL})`}>
          <Names names={names} scale={scale} />
        </g>
      </svg>
    </div>
  );
}

function Cameras({ scene }: { scene: RunScene }) {
  const [view, show] = useState(scene.view);
  useLayoutEffect(() => scene.onChange(() => show(scene.view)), [scene]);
  return (
    <select
      aria-label="Camera"
      class="cameras"
      value={String(view)}
      onChange={({ currentTarget: { value } }) => scene.choose(value as View)}
    >
      <option value="orbit">around the map</option>
      <option value="story">follow the story</option>
      {typeof view === "number" && <option value={String(view)}>follow a robot</option>}
    </select>
  );
}
