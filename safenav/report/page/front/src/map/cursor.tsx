/** The region under the pointer, or at the cursor of the arrow keys where a hand draws. */

import type { ComponentChildren } from "preact";
import { useLayoutEffect, useState } from "preact/hooks";
import { heard } from "../listening";
import { CELL, type Camera } from "./camera";
import { INK } from "./ink";
import { placeOf, regionAt } from "../run/run";

/** Receiver of pointer events on the map; positions are columns and rows, with fractions. */
export interface Hand {
  /** A press; false leaves it to the map. */
  down(x: number, y: number): boolean;
  move(x: number, y: number): void;
  up(x: number, y: number): void;
  /** Cancel the gesture: a second finger zooms the page. */
  drop?(): void;
  /** The pointer is no longer over the map. */
  leave(): void;
  cursor: string;
  over: ComponentChildren;
}

const STEPS: Record<string, [dx: number, dy: number]> = {
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
};

interface CursorArgs {
  room: { current: HTMLElement | null };
  camera: Camera;
  cols: number;
  rows: number;
  /** The cursor starts here. */
  first: number;
  hand: Hand | undefined;
}

/** `pointed`: the region under the pointer or at the cursor, -1 if there is none; `read` updates it. */
export function useCursor({ room, camera, cols, rows, first, hand }: CursorArgs) {
  const [hovered, hover] = useState(-1);
  const [at, put] = useState(-1);
  const [read, setRead] = useState<() => void>(() => () => undefined);
  useLayoutEffect(() => {
    const element = room.current!;
    let pointer: { x: number; y: number } | null = null;
    const look = (): void => {
      if (pointer === null) return hover(-1);
      const box = element.getBoundingClientRect();
      const [x, y] = camera.at(pointer.x - box.left, pointer.y - box.top);
      hover(regionAt({ cols, rows }, x, y));
    };
    const moved = (event: PointerEvent): void => {
      pointer = { x: event.clientX, y: event.clientY };
      put(-1);
      look();
    };
    const left = (): void => {
      pointer = null;
      look();
    };
    const stops = [heard(element, { pointermove: moved, pointerleave: left }), camera.onChange(look)];
    setRead(() => look);
    return () => stops.forEach((stop) => stop());
  }, [camera, cols, rows]);

  const keyed = (event: KeyboardEvent): void => {
    if (!hand || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = STEPS[event.key];
    if (!step && event.key !== "Enter") return;
    event.preventDefault();
    event.stopPropagation();
    if (at < 0) return go(hovered >= 0 ? hovered : first);
    const [col, row] = placeOf({ cols }, at);
    const middle = (x: number, y: number): [number, number] => [x + 0.5, y + 0.5];
    if (!step) {
      hand.down(...middle(col, row));
      hand.up(...middle(col, row));
      return;
    }
    const [x, y] = [col + step[0], row + step[1]];
    if (x < 0 || y < 0 || x >= cols || y >= rows) return;
    if (event.shiftKey && hand.down(...middle(col, row))) {
      hand.move(...middle(x, y));
      hand.up(...middle(x, y));
    }
    go(y * cols + x);
  };
  const go = (region: number): void => {
    const [col, row] = placeOf({ cols }, region);
    put(region);
    hand?.move(col + 0.5, row + 0.5);
    if (!camera.isWhole) camera.show(col, row);
  };
  const [col, row] = placeOf({ cols }, at);
  const mark = at >= 0 && <rect {...INK.cursor} x={col * CELL + 1} y={row * CELL + 1} width={CELL - 2} height={CELL - 2} />;
  return {
    pointed: at >= 0 ? at : hovered,
    read,
    mark,
    keys: hand && {
      tabIndex: 0,
      role: "application" as const,
      onKeyDown: keyed,
      onFocus: () => room.current!.matches(":focus-visible") && at < 0 && go(first),
      onBlur: () => put(-1),
    },
  };
}
