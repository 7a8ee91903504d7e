/** Tools of the map: zoom, show the whole, follow a robot, save a picture. */

import { useLayoutEffect, useReducer } from "preact/hooks";
import type { Camera } from "./camera";
import { Button } from "../panels/controls";
import { savePng, saveSvg } from "./picture";
import type { Run } from "../run/run";

export function Zoom({ camera }: { camera: Camera }) {
  const [, redraw] = useReducer((count: number) => count + 1, 0);
  useLayoutEffect(() => camera.onChange(() => redraw(0)), [camera]);
  const off = camera.isWhole && "the whole map is shown";
  return (
    <>
      <Button icon="slower" label="Zoom out" off={off} onClick={() => camera.zoom(1 / 1.5)} />
      <Button icon="faster" label="Zoom in" onClick={() => camera.zoom(1.5)} />
      <Button icon="fit" label="Whole map" off={off} onClick={() => camera.fit()} />
    </>
  );
}

export function Tools({ run, camera, tick }: { run: Run; camera: Camera; tick: number }) {
  const [, redraw] = useReducer((count: number) => count + 1, 0);
  useLayoutEffect(() => camera.onChange(() => redraw(0)), [camera]);
  const map = (): HTMLElement => document.querySelector<HTMLElement>(".map")!;
  const name = `${run.source.replace(/\.jsonl$/, "")}-${tick}`;
  return (
    <div class="tools" role="group" aria-label="View of the map">
      <Zoom camera={camera} />
      <label>
        <span class="unseen">Follow a robot</span>
        <select
          value={String(camera.followed ?? "")}
          onChange={(event) => {
            const chosen = event.currentTarget.value;
            camera.follow(chosen === "" ? null : Number(chosen));
          }}
        >
          <option value="">follow no robot</option>
          {run.robots.map((robot, i) => (
            <option value={String(i)}>follow {robot.name}</option>
          ))}
        </select>
      </label>
      <button type="button" title="Save this frame as PNG" onClick={() => savePng(map(), name)}>
        PNG
      </button>
      <button type="button" title="Save this frame as SVG" onClick={() => saveSvg(map(), name)}>
        SVG
      </button>
    </div>
  );
}
