/**
 * The obstacles of a run in the scene, at any moment: a door whose leaf swings open as it is pushed, fog that lifts when
 * it is sensed, and a box with a pictogram for all other types. A hidden one is drawn on the floor only.
 */

import { Color, DoubleSide, Group, IcosahedronGeometry, MeshLambertMaterial } from "three";
import { at, isWall, loadsOf, tickAt, type Obstacle, type Run, type Status } from "../run/run";
import { box, paint, pictogram, solid, themeColour } from "./bodies";
import { centreOf, sampleAt, type Motion, type Sampled } from "./motion";

const HEIGHT = 1.5;


/** The position of a load while robots carry it: metres from its region, and its scale. */
interface Held {
  x: number;
  y: number;
  z: number;
  yaw: number;
  scale: number;
}

/** One obstacle; `gone` runs from 0 to 1 while it is being resolved. */
abstract class Thing {
  readonly group = new Group();
  protected readonly solid = new Group();

  constructor() {
    this.group.add(this.solid);
  }

  /** Place it where robots hold it, until it is shown again. */
  carry({ x, y, z, yaw, scale }: Held): void {
    this.solid.scale.setScalar(scale);
    this.solid.position.set(x, y, z);
    this.solid.rotation.z = yaw;
  }

  /** The orientation of the obstacle in its region. */
  protected turned = 0;

  show(status: Status, gone: number): void {
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
class Door extends Thing {
  protected override readonly stays = true;
  private readonly hinge = new Group();
  private readonly leaf = new MeshLambertMaterial({ side: DoubleSide });

  /** `opens`: 1 or -1, so that the leaf swings away from the robot that pushes it. */
  constructor(
    side: number,
    northSouth: boolean,
    private readonly opens: 1 | -1,
  ) {
    super();
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
class Block extends Thing {
  private readonly material = new MeshLambertMaterial();

  constructor(side: number, shape: string) {
    super();
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
class Fog extends Thing {
  private readonly material = new MeshLambertMaterial({ transparent: true, depthWrite: false });

  constructor(side: number) {
    super();
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

/** The properties of the carriers that place a load. */
export interface Holder {
  readonly hold: [ahead: number, up: number];
  readonly room: number;
}

export class Obstacles {
  readonly group = new Group();
  private readonly things: Thing[];
  private tick = 0;

  constructor(
    private readonly run: Run,
    private readonly motion: Motion,
    private readonly robots: Sampled[],
    private readonly holders: Holder[],
  ) {
    this.things = run.obstacles.map((obstacle) => {
      const thing = this.made(obstacle);
      const [x, y] = centreOf(run, motion.side, obstacle.region);
      thing.group.position.set(x, y, 0);
      this.group.add(thing.group);
      return thing;
    });
  }

  update(tick: number, seconds: number): void {
    this.tick = tick;
    this.run.obstacles.forEach((obstacle, i) => {
      const status = at(obstacle.status, tick)[1];
      const thing = this.things[i]!;
      const carriers = at(obstacle.carried, tick)[1];
      thing.show(status, carriers.length > 0 ? 0 : this.resolved(obstacle, status, seconds));
      if (carriers.length > 0) thing.carry(this.held(obstacle, carriers, seconds));
    });
  }

  /** Return the place of a load between its carriers, at the height of the first; loads are stacked. */
  private held(obstacle: Obstacle, carriers: number[], seconds: number): Held {
    const { run, motion } = this;
    const samples = carriers.map((robot) => sampleAt(motion, this.robots[robot]!, seconds));
    const first = this.holders[carriers[0]!]!;
    const [x, y] = centreOf(run, motion.side, obstacle.region);
    const mean = (of: string): number => samples.reduce((sum, sample) => sum + sample[of]!, 0) / samples.length;
    const { qw, qx, qy, qz } = samples[0]! as Record<string, number | undefined>;
    const yaw = samples[0]!.yaw ?? (qw === undefined ? 0 : Math.atan2(2 * (qw * qz! + qx! * qy!), 1 - 2 * (qy! * qy! + qz! * qz!)));
    const tick = this.tick;
    const below = loadsOf(run, carriers[0]!, tick).findIndex((load) => load.name === obstacle.name);
    const [ahead, up] = carriers.length > 1 ? [0, first.hold[1]] : first.hold;
    const scale = carriers.length > 1 ? 1 : Math.min(1, first.room / (motion.side * 0.5));
    const flies = this.robots[carriers[0]!]!.track.kind === "flyer";
    return {
      x: mean("x") + ahead * Math.cos(yaw) - x,
      y: mean("y") + ahead * Math.sin(yaw) - y,
      z: up + (flies ? samples[0]!.z! : 0) + Math.max(0, below) * motion.side * 0.5 * scale,
      yaw,
      scale,
    };
  }

  private made(obstacle: Obstacle): Thing {
    const { side } = this.motion;
    if (obstacle.action === "sense") return new Fog(side);
    if (obstacle.action !== "push" && !/(^|[_-])(door|gate)$/.test(obstacle.type)) return new Block(side, obstacle.shape);
    const { run } = this;
    const free = (region: number): boolean => region >= 0 && region < run.rows * run.cols && !isWall(run, region);
    const northSouth = free(obstacle.region - run.cols) && free(obstacle.region + run.cols);
    return new Door(side, northSouth, this.away(obstacle, northSouth));
  }

  /** Return the side to which a door opens: 1 is north, or west in a horizontal passage. */
  private away(obstacle: Obstacle, northSouth: boolean): 1 | -1 {
    const push = this.motion.actions.find((action) => action[1] === obstacle.name);
    if (push === undefined) return 1;
    const { x, y } = sampleAt(this.motion, this.robots[push[0]]!, push[3]);
    const [doorX, doorY] = centreOf(this.run, this.motion.side, obstacle.region);
    return (northSouth ? y! - doorY : doorX - x!) > 0 ? -1 : 1;
  }

  /** The share of its resolution: it opens during the action that resolves it. */
  private resolved(obstacle: Obstacle, status: Status, seconds: number): number {
    if (status === "resolved") return 1;
    const resolves = (to: number): boolean => at(obstacle.status, tickAt(this.run, to + 0.002))[1] === "resolved";
    const now = this.motion.actions.find(([, name, , from, to]) => name === obstacle.name && from <= seconds && seconds < to && resolves(to));
    return now === undefined ? 0 : (seconds - now[3]) / Math.max(0.01, now[4] - now[3]);
  }
}
