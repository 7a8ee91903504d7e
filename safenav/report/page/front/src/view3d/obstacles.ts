/**
 * The obstacles of a run in the scene, at any moment: a door whose leaf swings open as it is pushed, and a box with a
 * pictogram for all other types. A hidden one is drawn on the floor only.
 */

import { Color, DoubleSide, Group, MeshLambertMaterial } from "three";
import { at, isWall, tickAt, type Obstacle, type Run, type Status } from "../run/run";
import { type Body, box, paint, pictogram, themeColour } from "./bodies";
import { centreOf, type Motion, sampleAt, type Sampled } from "./motion";

type Action = Motion["actions"][number];

const HEIGHT = 1.5;
/** The height of a robot's sign above its body, in metres. */
const SIGN = 0.35;

/** A box with the pictogram of its type; it shrinks as it is resolved. */
class Block {
  readonly group = new Group();
  protected readonly solid = new Group();
  protected readonly material = new MeshLambertMaterial({ side: DoubleSide });

  constructor(
    private readonly x: number,
    private readonly y: number,
    private readonly size: number,
  ) {
    this.group.add(this.solid);
  }

  fill(shape: string): this {
    const { size } = this;
    this.solid.add(box(size, size, size, this.material, 0, 0, size / 2));
    if (shape) this.solid.add(pictogram(shape, 0.85 * size, size + 0.01));
    return this;
  }

  /** Put it on the robot that carries it, else in its region. */
  place(carrier: Body | undefined): void {
    if (carrier) this.group.position.copy(carrier.group.position).setZ(carrier.group.position.z + carrier.top - SIGN);
    else this.group.position.set(this.x, this.y, 0);
  }

  /** `gone` runs from 0 to 1 while it is being resolved. */
  show(status: Status, gone: number): void {
    this.solid.visible = status !== "absent" && status !== "hidden" && gone < 1;
    this.material.color = themeColour(status === "absent" ? "hidden" : status);
    this.solid.scale.setScalar(Math.max(0.001, 1 - gone));
  }
}

/** A leaf between two posts, across the gap; it swings away from the robot that pushes it, and stays. */
class Door extends Block {
  private readonly hinge = new Group();
  private swing = 1;

  /** `turned`: across the gap. */
  constructor(
    private readonly east: number,
    private readonly north: number,
    side: number,
    private readonly turned: number,
  ) {
    super(east, north, side);
    const width = side * 0.92;
    const frame = paint(0x7b828c);
    for (const end of [-1, 1]) this.solid.add(box(0.12, 0.12, HEIGHT, frame, (end * width) / 2, 0, HEIGHT / 2));
    this.hinge.add(box(width - 0.14, 0.07, HEIGHT * 0.94, this.material, (width - 0.14) / 2, 0, HEIGHT * 0.48));
    this.hinge.position.set(-(width - 0.14) / 2, 0, 0);
    this.hinge.add(box(0.07, 0.2, 0.07, frame, width - 0.34, 0, HEIGHT * 0.5));
    this.solid.add(this.hinge);
  }

  /** A robot pushes it from there. */
  push(x: number, y: number): void {
    const beyond = (y - this.north) * Math.cos(this.turned) - (x - this.east) * Math.sin(this.turned);
    this.swing = beyond > 0 ? -1 : 1;
  }

  override show(status: Status, gone: number): void {
    super.show(status, 0);
    this.solid.rotation.z = this.turned;
    this.hinge.rotation.z = this.swing * gone * 1.5;
    if (gone >= 1) this.material.color = new Color(0xb08a5a);
  }
}

export class Obstacles {
  readonly group = new Group();
  private readonly things: Block[];

  constructor(
    private readonly run: Run,
    private readonly motion: Motion,
    private readonly robots: Sampled[],
    private readonly bodies: Body[],
  ) {
    this.things = run.obstacles.map((obstacle) => this.made(obstacle));
    for (const thing of this.things) this.group.add(thing.group);
  }

  update(tick: number, seconds: number): void {
    this.run.obstacles.forEach((obstacle, i) => {
      const thing = this.things[i]!;
      const status = at(obstacle.status, tick)[1];
      const carrier = this.bodies[at(obstacle.carried, tick)[1][0] ?? -1];
      const action = this.resolving(obstacle, seconds);
      if (action && thing instanceof Door) {
        const { x, y } = sampleAt(this.motion, this.robots[action[0]]!, action[3]);
        thing.push(x!, y!);
      }
      thing.show(status, carrier ? 0.5 : share(status, action, seconds));
      thing.place(carrier);
    });
  }

  private made(obstacle: Obstacle): Block {
    const { run, motion } = this;
    const [x, y] = centreOf(run, motion.side, obstacle.region);
    if (obstacle.action !== "push" && !/(^|[_-])(door|gate)$/.test(obstacle.type)) return new Block(x, y, motion.side / 2).fill(obstacle.shape);
    const free = (region: number): boolean => region >= 0 && region < run.rows * run.cols && !isWall(run, region);
    const northSouth = free(obstacle.region - run.cols) && free(obstacle.region + run.cols);
    return new Door(x, y, motion.side, northSouth ? 0 : Math.PI / 2);
  }

  /** The last action that resolves it, if it has begun. */
  private resolving(obstacle: Obstacle, seconds: number): Action | undefined {
    const resolves = (to: number): boolean => at(obstacle.status, tickAt(this.run, to + 0.002))[1] === "resolved";
    return this.motion.actions.filter(([, name, , from, to]) => name === obstacle.name && from <= seconds && resolves(to)).at(-1);
  }
}

/** The share of a resolution: an obstacle opens during the action that resolves it. */
function share(status: Status, action: Action | undefined, seconds: number): number {
  if (status === "resolved") return 1;
  if (!action || seconds >= action[4]) return 0;
  return (seconds - action[3]) / Math.max(0.01, action[4] - action[3]);
}
