/**
 * The visible part of the map: its centre, its scale, and the robot that it follows.
 *
 * The camera owns the `viewBox` of every layer of the map and writes it by hand, as it changes
 * with every frame while a robot is followed. Positions are in cells, screen lengths in pixels.
 */

import { clamp } from "../run/run";

/** Units of the drawings for one cell. */
export const CELL = 40;
const MARGIN = 2 / CELL;
/** The part of an outer wall that is not shown. */
const HALF = 0.5 + MARGIN;
const CLOSEST = 280;

/** The shown part of a map, in cells: columns from `left` to `right`, rows from `top` to `bottom`. */
export interface Extent {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

/** All of a map, but only half of its outer walls. */
export function extentOf({ cols, rows, grid }: { cols: number; rows: number; grid: string[] }): Extent {
  const half = (outer: string): number => (/^#*$/.test(outer) ? HALF : 0);
  const column = (col: number): string => grid.map((row) => row[col]).join("");
  return {
    left: half(column(0)),
    top: half(grid[0]!),
    right: cols - half(column(cols - 1)),
    bottom: rows - half(grid[rows - 1]!),
  };
}

/** Operations on the view, on every stage. */
export interface Eye {
  /** The index of the robot that stays in the middle, or null. */
  readonly followed: number | null;
  /** Whether all of the map is shown. */
  readonly isWhole: boolean;
  /** Call back when the followed robot or the scale has changed; the result unsubscribes. */
  onChange(listener: () => void): () => void;
  fit(): void;
  zoom(factor: number): void;
  /** Moves the map by dx and dy pixels. */
  pan(dx: number, dy: number): void;
  /** Brings a column and row into view. */
  show(x: number, y: number): void;
  follow(robot: number | null): void;
}

export class Camera implements Eye {
  /** Pixels of a cell; the whole map fits in at `fitted`. */
  scale = 1;
  fitted = 1;
  /** The index of the robot that stays in the middle, or null. */
  followed: number | null = null;
  private x: number;
  private y: number;
  private width = 1;
  private height = 1;
  private whole = true;
  private layers: SVGSVGElement[] = [];
  private listeners = new Set<() => void>();

  constructor(readonly extent: Extent) {
    this.x = (extent.left + extent.right) / 2;
    this.y = (extent.top + extent.bottom) / 2;
  }

  /** Call back when the scale or the followed robot has changed, but not for each motion. */
  onChange(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Width over height of the shown part. */
  get ratio(): number {
    const { left, top, right, bottom } = this.extent;
    return (right - left) / (bottom - top);
  }

  /** The part of the height that is wall below the map, which words may cover. */
  get wall(): number {
    const { top, bottom } = this.extent;
    return bottom % 1 ? (1 - HALF) / (bottom - top) : 0;
  }

  get isWhole(): boolean {
    return this.whole && this.followed === null;
  }

  /** Set the layers whose view is kept equal, and the size of their container. */
  attach(layers: SVGSVGElement[], width: number, height: number): void {
    this.layers = layers;
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
    const { left, top, right, bottom } = this.extent;
    this.fitted = Math.min(this.width / (right - left + 2 * MARGIN), this.height / (bottom - top + 2 * MARGIN));
    if (this.whole) this.fit();
    else this.change(this.scale, this.x, this.y);
  }

  fit(): void {
    this.whole = true;
    this.followed = null;
    const { left, top, right, bottom } = this.extent;
    this.place(this.fitted, (left + right) / 2, (top + bottom) / 2);
  }

  /** Zoom by a factor about a point of the container, by default its centre. */
  zoom(factor: number, px = this.width / 2, py = this.height / 2): void {
    const scale = clamp(this.scale * factor, this.fitted, Math.max(CLOSEST, this.fitted));
    if (scale <= this.fitted * 1.001 && this.followed === null) return this.fit();
    const [x, y] = this.at(px, py);
    const shift = (pixels: number, size: number): number => (pixels - size / 2) / scale;
    this.change(scale, x - shift(px, this.width), y - shift(py, this.height));
  }

  /** Move the map by dx and dy pixels and stop following a robot. */
  pan(dx: number, dy: number): void {
    this.followed = null;
    this.change(this.scale, this.x - dx / this.scale, this.y - dy / this.scale);
  }

  /** Bring a column and row into view, close enough to be legible. */
  show(x: number, y: number): void {
    if (this.isWhole && this.scale >= 20) return;
    this.followed = null;
    this.change(Math.max(this.scale, 30), x + 0.5, y + 0.5);
  }

  follow(robot: number | null): void {
    if (robot === null) return this.fit();
    this.followed = robot;
    this.change(Math.max(this.scale, Math.min(2 * this.fitted, 56)), this.x, this.y);
  }

  /** Keep the followed robot in the centre; called per frame. */
  track(x: number, y: number): void {
    if (this.followed === null) return;
    this.x = x + 0.5;
    this.y = y + 0.5;
    this.write();
  }

  /** Return column and row, with fractions, at a point of the container. */
  at(px: number, py: number): [x: number, y: number] {
    return [this.x + (px - this.width / 2) / this.scale, this.y + (py - this.height / 2) / this.scale];
  }

  private change(scale: number, x: number, y: number): void {
    this.whole = false;
    const least = Math.max(this.fitted, scale);
    const { left, top, right, bottom } = this.extent;
    const span = (size: number, low: number, high: number, value: number): number => {
      const half = Math.min(size / least / 2, (high - low) / 2 + MARGIN);
      return clamp(value, low + half - MARGIN, high - half + MARGIN);
    };
    const free = this.followed !== null;
    this.place(least, free ? x : span(this.width, left, right, x), free ? y : span(this.height, top, bottom, y));
  }

  private place(scale: number, x: number, y: number): void {
    this.scale = scale;
    this.x = x;
    this.y = y;
    this.write();
    for (const listener of this.listeners) listener();
  }

  private write(): void {
    const width = (this.width / this.scale) * CELL;
    const height = (this.height / this.scale) * CELL;
    const box = [this.x * CELL - width / 2, this.y * CELL - height / 2, width, height];
    const text = box.map((value) => value.toFixed(2)).join(" ");
    for (const layer of this.layers) layer.setAttribute("viewBox", text);
  }
}
