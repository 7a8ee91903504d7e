/** The zoom of the map. */

import { useLayoutEffect, useReducer } from "preact/hooks";
import type { Camera } from "./camera";
import { Button } from "../panels/controls";

export function Zoom({ camera }: { camera: Camera }) {
  const [, redraw] = useReducer((count: number) => count + 1, 0);
  useLayoutEffect(() => camera.onChange(() => redraw(0)), [camera]);
  const off = camera.isWhole && "the whole map is shown";
  return (
    <div class="tools" role="group" aria-label="View of the map">
      <Button icon="minus" label="Zoom out" off={off} onClick={() => camera.zoom(1 / 1.5)} />
      <Button icon="plus" label="Zoom in" onClick={() => camera.zoom(1.5)} />
      <Button icon="fit" label="Whole map" off={off} onClick={() => camera.fit()} />
    </div>
  );
}
