/** The interface of drawn robots. */

import type { Group } from "three";
import type { Sample } from "./motion";

/** A robot's present action with its hands or its sensor; 0 at its start, 1 at its end. */
export interface Doing {
  action: string;
  strength: number;
}

export interface Body {
  readonly group: Group;
  /** The height of signs above the robot, in metres above its group. */
  readonly top: number;
  /** The position of a load that it holds: metres ahead of its centre, and above its group (a flyer: its centre). */
  readonly hold: [ahead: number, up: number];
  /** The size limit of its loads in metres. */
  readonly room: number;
  pose(sample: Sample, seconds: number, doing: Doing | null): void;
}
