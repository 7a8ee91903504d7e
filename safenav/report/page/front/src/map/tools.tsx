/** The zoom of the map. */

import { useLayoutEffect, useReducer } from "preact/hooks";
import type { Camera } from "./camera";
import { Button } from "../panels/button";

export function Zoom({ camera }: { camera: Camera }) {
  const [, redraw] = useReducer((count: number) => count + 1, 0);
  useLayoutEffect(() => camera.onChange(() => redraw(0)), [camera]);
  const off = camera.isWhole && "the whole map is shown";
  return (
    <div class="tools" role="group" aria-label="View of the map">
      <Button icon="minus" label="Zoom out" off={off} act={() => camera.zoom(1 / 1.5)} />
      <Button icon="plus" label="Zoom in" act={() => camera.zoom(1.5)} />
      <Button icon="fit" label="Whole map" off={off} act={() => camera.fit()} />
    </div>
  );
}
