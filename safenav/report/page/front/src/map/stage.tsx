/** The stage of a page, which shows the run at a moment: the flat map or the 3D scene. */

import type { ComponentType } from "preact";
import { useLayoutEffect, useReducer } from "preact/hooks";
import { Camera, type Extent, type Eye } from "./camera";
import type { Hand } from "./cursor";
import { FlatMarks } from "./legend";
import { MapView } from "./map";
import { Button } from "../panels/button";
import type { Player } from "../run/player";
import type { Run } from "../run/run";
import type { Shown, Theme } from "../settings";

export interface StageProps {
  run: Run;
  player: Player;
  tick: number;
  shown: Shown;
  /** A recently highlighted region, or null. */
  pointed: number | null;
  /** The region that the story is about now, -1 for none. */
  spoken: number;
  theme: Theme;
  /** The hand that takes presses on the map instead of moving it. */
  hand?: Hand | undefined;
}

/** A part of the picture that can be hidden, and its label. */
export type Choice = [key: Exclude<keyof Shown, "viewer">, words: string];

/** The drawn pose of a robot: its region, and one of N E S W if it has a heading. */
export interface Whereabouts {
  region: number;
  heading: string | null;
}

export interface Stage {
  View: ComponentType<StageProps>;
  /** Its buttons, unless they stand in the view. */
  Tools?: ComponentType;
  /** The rows of the legend for what it draws. */
  Marks: ComponentType<{ run: Run }>;
  eye: Eye;
  choices: Choice[];
  /** Positions of robots between whole ticks. */
  where?: (robot: number, time: number) => Whereabouts;
}

const CHOICES: Choice[] = [
  ["numbers", "region numbers"],
  ["names", "names"],
  ["trails", "trails"],
  ["targets", "targets"],
  ["hidden", "hidden obstacles"],
];

/** The flat map with its tools. */
export function flatStage(extent: Extent): Stage {
  const camera = new Camera(extent);
  const View = ({ theme: _, ...props }: StageProps) => <MapView {...props} camera={camera} />;
  const Tools = () => <Zoom camera={camera} />;
  return { View, Tools, Marks: FlatMarks, eye: camera, choices: CHOICES };
}

/** The zoom of the map. */
export function Zoom({ camera }: { camera: Camera }) {
  const [, redraw] = useReducer((count: number) => count + 1, 0);
  useLayoutEffect(() => camera.onChange(() => redraw(0)), [camera]);
  const off = camera.isWhole && "the whole map is shown";
  return (
    <div class="tools row" role="group" aria-label="View of the map">
      <Button icon="minus" label="Zoom out" off={off} act={() => camera.zoom(1 / 1.5)} />
      <Button icon="plus" label="Zoom in" act={() => camera.zoom(1.5)} />
      <Button icon="fit" label="Whole map" off={off} act={() => camera.fit()} />
    </div>
  );
}
