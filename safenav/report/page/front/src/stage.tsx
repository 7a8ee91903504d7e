/** The stage of a page: what shows the run at a moment. The flat map is one, the 3D scene another. */

import type { ComponentType } from "preact";
import { Camera, type Eye } from "./camera";
import { MapView } from "./map";
import type { Player } from "./player";
import type { Run } from "./run";
import type { Shown, Theme } from "./settings";
import { Tools } from "./tools";

export interface StageProps {
  run: Run;
  player: Player;
  tick: number;
  shown: Shown;
  /** A region that the reader was pointed to just now, or null. */
  pointed: number | null;
  theme: Theme;
}

/** Something that can be shown or hidden, in words. */
export type Choice = [key: Exclude<keyof Shown, "viewer">, words: string];

export interface Stage {
  View: ComponentType<StageProps>;
  eye: Eye;
  choices: Choice[];
}

const CHOICES: Choice[] = [
  ["numbers", "region numbers"],
  ["names", "names"],
  ["trails", "trails"],
  ["targets", "targets"],
  ["hidden", "hidden obstacles"],
];

/** The flat map with its tools. */
export function flatStage(run: Run): Stage {
  const camera = new Camera(run.cols, run.rows);
  const View = ({ theme: _, ...props }: StageProps) => (
    <>
      <MapView {...props} camera={camera} />
      <Tools run={run} camera={camera} tick={props.tick} />
    </>
  );
  return { View, eye: camera, choices: CHOICES };
}
