/**
 * Bodies of obstacles: a door whose leaf swings open as it is pushed, fog that lifts when it is
 * sensed, and a heap for types without a body of their own. An undiscovered obstacle is a faint outline.
 */

import { BoxGeometry, Color, CylinderGeometry, DoubleSide, EdgesGeometry, Group, IcosahedronGeometry, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, SphereGeometry } from "three";
import type { Status } from "../run/run";
import { box, column, paint, solid as placed, themeColour, upright } from "./solids";

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

  /** The number of its completed actions. */
  stage(_done: number): void {}

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
  private lock: Mesh | null = null;

  /** `opens`: 1 or -1, so that the leaf swings away from the robot that pushes it. */
  constructor(
    side: number,
    northSouth: boolean,
    private readonly opens: 1 | -1,
    barred = false,
  ) {
    super(side);
    const width = side * 0.92;
    const frame = paint(0x7b828c);
    for (const x of [-1, 1]) {
      this.solid.add(box(0.12, 0.12, HEIGHT, frame, (x * width) / 2, 0, HEIGHT / 2));
    }
    if (barred) {
      for (let i = 0; i < 9; i++) this.hinge.add(box(0.05, 0.05, HEIGHT * 0.94, this.leaf, ((width - 0.14) * (i + 0.5)) / 9, 0, HEIGHT * 0.48));
      for (const z of [0.12, 0.85]) this.hinge.add(box(width - 0.14, 0.06, 0.06, this.leaf, (width - 0.14) / 2, 0, HEIGHT * z));
      this.lock = box(0.3, 0.18, 0.3, paint(0xd9a520), width - 0.4, 0, HEIGHT * 0.5);
      this.hinge.add(this.lock);
    } else this.hinge.add(box(width - 0.14, 0.07, HEIGHT * 0.94, this.leaf, (width - 0.14) / 2, 0, HEIGHT * 0.48));
    this.hinge.position.set(-(width - 0.14) / 2, 0, 0);
    this.hinge.add(box(0.07, 0.2, 0.07, frame, width - 0.34, 0, HEIGHT * 0.5));
    this.solid.add(this.hinge);
    this.turned = northSouth ? 0 : Math.PI / 2;
  }

  override stage(done: number): void {
    if (this.lock !== null) this.lock.visible = done === 0;
  }

  protected become(status: Status, gone: number): void {
    this.hinge.rotation.z = gone * 1.5 * this.opens;
    this.leaf.color = gone >= 1 ? new Color(0xb08a5a) : statusColour(status);
  }
}

/** Two leaves that slide apart: a door with a button beside it, or an elevator with arrows above. */
export class Sliding extends Thing {
  protected override readonly stays = true;
  private readonly material = new MeshLambertMaterial();
  private readonly lamp = new MeshLambertMaterial();
  private readonly leaves: Mesh[];

  constructor(
    private readonly side: number,
    northSouth: boolean,
    lifts: boolean,
  ) {
    super(side);
    const frame = paint(0x7b828c);
    const width = side * 0.92;
    for (const x of [-1, 1]) this.solid.add(box(0.16, lifts ? side * 0.8 : 0.2, HEIGHT, frame, (x * width) / 2, lifts ? side * 0.05 : 0, HEIGHT / 2));
    this.solid.add(box(width, 0.2, 0.14, frame, 0, 0, HEIGHT));
    this.leaves = [-1, 1].map((x) => box(width / 2 - 0.08, 0.07, HEIGHT * 0.92, this.material, (x * width) / 4, 0, HEIGHT * 0.46));
    this.solid.add(...this.leaves);
    if (lifts) {
      const dark = paint(0x2b3038);
      this.solid.add(box(width, 0.24, 0.62, dark, 0, 0, HEIGHT + 0.36));
      for (const [x, turn] of [[-0.34, 0], [0.34, Math.PI]] as const) for (const front of [-1, 1]) {
        const arrow = placed(new CylinderGeometry(0.24, 0.24, 0.05, 3), this.lamp, x, front * 0.13, HEIGHT + 0.36);
        arrow.rotation.y = turn;
        this.solid.add(arrow);
      }
    }
    else this.solid.add(placed(new SphereGeometry(0.07, 12, 8), this.lamp, width / 2, -0.16, HEIGHT * 0.55));
    this.turned = northSouth ? 0 : Math.PI / 2;
  }

  protected become(status: Status, gone: number): void {
    const open = (this.side * 0.92) / 4 - 0.06;
    this.leaves.forEach((leaf, i) => (leaf.position.x = (i === 0 ? -1 : 1) * ((this.side * 0.92) / 4 + gone * open)));
    this.material.color = gone >= 1 ? new Color(0xb9c2cc) : statusColour(status);
    this.lamp.color = new Color(gone > 0 ? 0x2fae5a : 0xd14b3a);
  }
}

type Build = (own: MeshLambertMaterial, side: number) => Mesh[];
type Leave = (solid: Group, gone: number, side: number) => void;

/** A thing that does not move, made by `build`, and disappears by `leave`. */
class Still extends Thing {
  private readonly material = new MeshLambertMaterial();

  constructor(
    private readonly side: number,
    build: Build,
    private readonly leave: Leave,
  ) {
    super(side);
    this.solid.add(...build(this.material, side));
  }

  protected become(status: Status, gone: number): void {
    this.material.color = statusColour(status);
    this.leave(this.solid, gone, this.side);
  }
}

const shrunk: Leave = (solid, gone) => solid.scale.setScalar(Math.max(0.001, 1 - gone));

const lifted: Leave = (solid, gone, side) => {
  solid.position.z = Math.min(0.5, gone);
  shrunk(solid, Math.max(0, gone * 2 - 1), side);
};

/** Boxes on a pallet of boards. */
const pallet: Build = (own, s) => {
  const [wood, card] = [paint(0xb08a5a), paint(0xcaa472)];
  const w = s * 0.5;
  const boards = [-0.4, -0.13, 0.13, 0.4].map((y) => box(w, w * 0.16, w * 0.04, wood, 0, y * w, w * 0.15));
  const feet = [-0.4, 0, 0.4].map((x) => box(w * 0.14, w * 0.95, w * 0.13, wood, x * w, 0, w * 0.065));
  const boxes = [-1, 1].flatMap((x) => [-1, 1].map((y) => box(w * 0.43, w * 0.43, w * 0.4, card, x * w * 0.23, y * w * 0.23, w * 0.38)));
  return [...boards, ...feet, ...boxes, box(w * 0.92, w * 0.05, w * 0.42, own, 0, 0, w * 0.38)];
};

/** A cardboard box with tape. */
const parcel: Build = (own, s) => {
  const w = s * 0.36;
  return [box(w, w * 0.8, w * 0.6, paint(0xcaa472), 0, 0, w * 0.3), box(w * 1.01, w * 0.14, w * 0.61, own, 0, 0, w * 0.3)];
};

/** A white case with a cross on its top and on its front. */
const medicine: Build = (own, s) => {
  const w = s * 0.36;
  const red = paint(0xd0342c);
  const bars = [[0.5, 0.16], [0.16, 0.5]] as const;
  return [
    box(w, w * 0.8, w * 0.6, paint(0xf4f6f8), 0, 0, w * 0.3),
    box(w * 1.02, w * 0.82, w * 0.06, own, 0, 0, w * 0.45),
    ...bars.map(([a, b]) => box(w * a, w * b, 0.02, red, 0, 0, w * 0.61)),
    ...bars.map(([a, b]) => box(w * a, 0.02, w * b, red, 0, -w * 0.41, w * 0.3)),
  ];
};

/** A wooden box with edges. */
const crate: Build = (own, s) => {
  const [size, rim] = [s * 0.5, s * 0.06];
  const edges = [-1, 1].flatMap((a) => [-1, 1].flatMap((b) => [
    box(size + rim, rim, rim, own, 0, (a * size) / 2, size / 2 + (b * size) / 2),
    box(rim, size + rim, rim, own, (a * size) / 2, 0, size / 2 + (b * size) / 2),
    box(rim, rim, size + rim, own, (a * size) / 2, (b * size) / 2, size / 2),
  ]));
  return [box(size, size, size, paint(0xb08a5a), 0, 0, size / 2), ...edges];
};

const spill: Build = (own, s) => [
  upright(s * 0.32, 0.02, own, 0, 0, 0.012, s * 0.36),
  upright(s * 0.16, 0.02, own, s * 0.24, s * 0.2, 0.012, s * 0.18),
];

const person: Build = (own) => [
  placed(new SphereGeometry(0.12, 16, 12), paint(0xd9a679), 0, 0, 1.62),
  column(0.17, 0.42, own, 0, 0, 1.12),
  ...[-0.1, 0.1].map((y) => column(0.075, 0.7, paint(0x39414d), 0, y, 0.43)),
  ...[-0.25, 0.25].map((y) => column(0.05, 0.48, own, 0, y, 1.1)),
];

const walksAway: Leave = (solid, gone, side) => {
  solid.position.x = gone * side * 0.7;
  shrunk(solid, Math.max(0, gone * 3 - 2), side);
};

const battery: Build = (own) => [
  box(0.6, 0.34, 0.4, paint(0x39414d), 0, 0, 0.2),
  box(0.62, 0.36, 0.1, own, 0, 0, 0.2),
  ...[-0.18, 0.18].map((x) => upright(0.05, 0.1, own, x, 0, 0.45)),
];

const takenOut: Leave = (solid, gone, side) => {
  solid.position.z = gone * 0.8;
  shrunk(solid, gone, side);
};

/** A heap of eight stones around, and three on top of one another in the middle. */
const heap: Build = (own, s) =>
  [...Array(11).keys()].map((i) => {
    const [angle, out] = [i * 2.4, s * (i < 8 ? 0.2 + 0.06 * (i % 2) : 0.05)];
    const up = s * (i < 8 ? 0.06 : 0.08 + 0.12 * (i - 8));
    const stone = placed(new IcosahedronGeometry(s * (0.1 + 0.025 * (i % 3)), 0), own, Math.cos(angle) * out, Math.sin(angle) * out, up);
    stone.rotation.set(i, i * 2, i * 3);
    return stone;
  });

/** Puffs over the region; they thin out and rise as it is sensed. */
class Fog extends Thing {
  private readonly material = new MeshLambertMaterial({ transparent: true, depthWrite: false });

  /** `storeys`: how high it stands; `smoke`: its own colour. */
  constructor(
    side: number,
    storeys = 1,
    private readonly smoke: number | null = null,
  ) {
    super(side);
    for (let i = 0; i < 9 * storeys; i++) {
      const [x, y] = [((i % 3) - 1) * side * 0.26, ((Math.floor(i / 3) % 3) - 1) * side * 0.26];
      const up = 0.28 + 0.1 * ((i * 7) % 4) + 0.7 * Math.floor(i / 9);
      this.solid.add(placed(new IcosahedronGeometry(side * (0.15 + 0.04 * (i % 3)), 2), this.material, x, y, up));
    }
  }

  protected become(status: Status, gone: number): void {
    this.material.opacity = 0.62 * (1 - gone);
    this.material.color = this.smoke === null ? statusColour(status) : new Color(this.smoke).lerp(statusColour(status), 0.2);
    this.solid.position.z = gone * 0.6;
  }
}

const STILL: Record<string, [Build, Leave]> = {
  spill: [spill, shrunk],
  crate: [crate, lifted],
  pallet: [pallet, lifted],
  parcel: [parcel, lifted],
  medicine: [medicine, lifted],
  person: [person, walksAway],
  flat_battery: [battery, takenOut],
  debris: [heap, shrunk],
};

/** Things by the type of obstacle. */
export const THINGS: Record<string, (side: number) => Thing> = {
  ...Object.fromEntries(Object.entries(STILL).map(([type, made]) => [type, (side: number) => new Still(side, ...made)])),
  uncertainty: (side) => new Fog(side),
  smoke: (side) => new Fog(side, 3, 0x4a4f57),
};
