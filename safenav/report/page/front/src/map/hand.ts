/** Handling of presses on the map by a page, instead of moving it. */

import type { ComponentChildren } from "preact";

/** Receiver of pointer events on the map; positions are columns and rows, with fractions. */
export interface Hand {
  /** A press; false leaves it to the map. */
  down(x: number, y: number): boolean;
  move(x: number, y: number): void;
  up(x: number, y: number): void;
  /** Cancel the gesture: a second finger zooms the map. */
  drop?(): void;
  /** The pointer is no longer over the map. */
  leave(): void;
  cursor: string;
  over: ComponentChildren;
}
