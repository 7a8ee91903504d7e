/** The view of the 3D scene as the page's keys and panels know it; the scene moves its camera. */

import type { Eye } from "../map/camera";

/** Around the map, from above, following the story, or following the robot with that index. */
export type View = "orbit" | "top" | "story" | number;

/** The part of the scene that an eye needs. */
export interface Lens {
  look(view: View): void;
  dolly(factor: number): void;
  slide(dx: number, dy: number): void;
  aim(x: number, y: number): void;
}

export class OrbitEye implements Eye {
  view: View = "orbit";
  private lens: Lens | null = null;
  private moved = false;
  private readonly listeners = new Set<() => void>();

  attach(lens: Lens | null): void {
    this.lens = lens;
  }

  get followed(): number | null {
    return typeof this.view === "number" ? this.view : null;
  }

  get isWhole(): boolean {
    return this.followed === null && this.view !== "story" && !this.moved;
  }

  onChange(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  choose(view: View): void {
    this.view = view;
    this.moved = false;
    this.lens?.look(view);
    this.changed();
  }

  fit(): void {
    this.choose(this.view === "top" ? "top" : "orbit");
  }

  follow(robot: number | null): void {
    this.choose(robot ?? "orbit");
  }

  zoom(factor: number): void {
    this.move(() => this.lens?.dolly(1 / factor));
  }

  pan(dx: number, dy: number): void {
    this.move(() => this.lens?.slide(dx, dy));
  }

  show(x: number, y: number): void {
    if (this.view === "story") return;
    this.lens?.aim(x, y);
    this.changed();
  }

  private move(how: () => void): void {
    this.moved = true;
    how();
    this.changed();
  }

  private changed(): void {
    for (const listener of this.listeners) listener();
  }
}
