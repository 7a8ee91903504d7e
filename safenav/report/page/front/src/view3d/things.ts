/**
 * Bodies of obstacles: a door whose leaf swings open as it is pushed, fog that lifts when it is
 * sensed, and a box with a pictogram for all other types. An undiscovered obstacle is a faint outline.
 */

import { BoxGeometry, Color, DoubleSide, EdgesGeometry, Group, IcosahedronGeometry, LineBasicMaterial, LineSegments, MeshLambertMaterial } from "three";
import type { Status } from "../run/run";
import { box, paint, pictogram, solid, themeColour } from "./solids";

const HEIGHT = 1.5;

/** The position of a load while robots carry it: metres from its region, and its scale. */
export interface Held {
  x: number;
  y: number;
  z: number;
  yaw: number;
  scale: number;
}

/** One obstacle; `gone` runs from 0 to 1 while it is being resolved. */
export abstract class Thing {
  readonly group = new Group();
  private readonly outline: LineSegments;
  protected readonly solid = new Group();

  constructor(side: number) {
    const box = new EdgesGeometry(new BoxGeometry(side * 0.86, side * 0.86, HEIGHT * 0.6));
    this.outline = new LineSegments(box, new LineBasicMaterial({ transparent: true, opacity: 0.55 }));
    this.outline.position.z = HEIGHT * 0.3;
    this.group.add(this.outline, this.solid);
  }

  /** Place it where robots hold it, until it is shown again. */
  carry({ x, y, z, yaw, scale }: Held): void {
    this.solid.scale.setScalar(scale);
    this.solid.position.set(x, y, z);
    this.solid.rotation.z = yaw;
  }

  /** The orientation of the obstacle in its region. */
  protected turned = 0;

  show(status: Status, gone: number, hidden: boolean): void {
    this.outline.visible = status === "hidden" && hidden;
    (this.outline.material as LineBasicMaterial).color = themeColour("hidden");
    this.solid.position.set(0, 0, 0);
    this.solid.rotation.z = this.turned;
    this.solid.scale.setScalar(1);
    this.solid.visible = status !== "absent" && status !== "hidden" && (gone < 1 || this.stays);
    this.become(status, gone);
  }

  /** Whether a part of it remains when it is resolved. */
  protected readonly stays: boolean = false;

  protected abstract become(status: Status, gone: number): void;
}

function statusColour(status: Status): Color {
  return themeColour(status === "absent" ? "hidden" : status);
}

/** A leaf between two posts, across the gap. */
export class Door extends Thing {
  protected override readonly stays = true;
  private readonly hinge = new Group();
  private readonly leaf = new MeshLambertMaterial({ side: DoubleSide });

  /** `opens`: 1 or -1, so that the leaf swings away from the robot that pushes it. */
  constructor(
    side: number,
    northSouth: boolean,
    private readonly opens: 1 | -1,
  ) {
    super(side);
    const width = side * 0.92;
    const frame = paint(0x7b828c);
    for (const x of [-1, 1]) {
      this.solid.add(box(0.12, 0.12, HEIGHT, frame, (x * width) / 2, 0, HEIGHT / 2));
    }
    this.hinge.add(box(width - 0.14, 0.07, HEIGHT * 0.94, this.leaf, (width - 0.14) / 2, 0, HEIGHT * 0.48));
    this.hinge.position.set(-(width - 0.14) / 2, 0, 0);
    this.hinge.add(box(0.07, 0.2, 0.07, frame, width - 0.34, 0, HEIGHT * 0.5));
    this.solid.add(this.hinge);
    this.turned = northSouth ? 0 : Math.PI / 2;
  }

  protected become(status: Status, gone: number): void {
    this.hinge.rotation.z = gone * 1.5 * this.opens;
    this.leaf.color = gone >= 1 ? new Color(0xb08a5a) : statusColour(status);
  }
}

/** A box with the pictogram of its type; it shrinks as it is resolved. */
export class Block extends Thing {
  private readonly material = new MeshLambertMaterial();

  constructor(side: number, shape: string) {
    super(side);
    const size = 0.5 * side;
    this.solid.add(box(size, size, size, this.material, 0, 0, size / 2));
    if (shape) this.solid.add(pictogram(shape, 0.85 * size, size + 0.01));
  }

  protected become(status: Status, gone: number): void {
    this.material.color = statusColour(status);
    this.solid.scale.multiplyScalar(Math.max(0.001, 1 - gone));
  }
}

/** Puffs over the region; they thin out and rise as it is sensed. */
export class Fog extends Thing {
  private readonly material = new MeshLambertMaterial({ transparent: true, depthWrite: false });

  constructor(side: number) {
    super(side);
    for (let i = 0; i < 9; i++) {
      const [x, y] = [((i % 3) - 1) * side * 0.26, (Math.floor(i / 3) - 1) * side * 0.26];
      const puff = new IcosahedronGeometry(side * (0.15 + 0.04 * (i % 3)), 2);
      this.solid.add(solid(puff, this.material, x, y, 0.28 + 0.1 * ((i * 7) % 4)));
    }
  }

  protected become(status: Status, gone: number): void {
    this.material.opacity = 0.62 * (1 - gone);
    this.material.color = statusColour(status);
    this.solid.position.z = gone * 0.6;
  }
}
