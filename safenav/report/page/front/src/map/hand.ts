/** What a page does with presses on the map, instead of moving it. */

import type { ComponentChildren } from "preact";

/** Takes what a pointer does on the map; places are in columns and rows, with fractions. */
export interface Hand {
  /** A press; false leaves it to the map. */
  down(x: number, y: number): boolean;
  move(x: number, y: number): void;
  up(x: number, y: number): void;
  /** Forgets what a press began: a second finger zooms the map. */
  drop?(): void;
  /** The pointer is no longer over the map. */
  leave(): void;
  cursor: string;
  over: ComponentChildren;
}
