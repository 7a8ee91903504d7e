/**
 * The obstacles of a run in the scene, at any moment: a door whose leaf swings open as it is pushed, and a box with a
 * pictogram for all other types. A hidden one is drawn on the floor only.
 */

import { Color, DoubleSide, Group, MeshLambertMaterial } from "three";
import { at, isWall, tickAt, type Obstacle, type Run, type Status } from "../run/run";
import { type Body, box, paint, pictogram, themeColour } from "./bodies";
import { centreOf, sampleAt, type Motion, type Sampled } from "./motion";

const HEIGHT = 1.5;

/** A box with the pictogram of its type; it shrinks as it is resolved. */
class Block {
  readonly group = new Group();
  protected readonly solid = new Group();
  protected readonly material = new MeshLambertMaterial({ side: DoubleSide });

  constructor(
    x: number,
    y: number,
    private readonly size: number,
  ) {
    this.group.position.set(x, y, 0);
    this.group.add(this.solid);
  }

  fill(shape: string): this {
    const { size } = this;
    this.solid.add(box(size, size, size, this.material, 0, 0, size / 2));
    if (shape) this.solid.add(pictogram(shape, 0.85 * size, size + 0.01));
    return this;
  }

  /** Put it on a robot, above other loads, until it is shown again. */
  carry({ hand, room }: Body, below: number): void {
    const scale = Math.min(1, room / this.size);
    hand.add(this.solid);
    this.solid.scale.setScalar(scale);
    this.solid.position.z = below * this.size * scale;
  }

  /** `gone` runs from 0 to 1 while it is being resolved. */
  show(status: Status, gone: number): void {
    this.solid.visible = status !== "absent" && status !== "hidden" && gone < 1;
    this.material.color = themeColour(status === "absent" ? "hidden" : status);
    this.group.add(this.solid);
    this.solid.position.z = 0;
    this.solid.scale.setScalar(Math.max(0.001, 1 - gone));
  }
}

/** A leaf between two posts, across the gap; it stays when it is resolved. */
class Door extends Block {
  private readonly hinge = new Group();

  /** `turned`: across the gap; `opens`: 1 or -1, so that the leaf swings away from the robot that pushes it. */
  constructor(
    x: number,
    y: number,
    side: number,
    private readonly turned: number,
    private readonly opens: 1 | -1,
  ) {
    super(x, y, side);
    const width = side * 0.92;
    const frame = paint(0x7b828c);
    for (const end of [-1, 1]) this.solid.add(box(0.12, 0.12, HEIGHT, frame, (end * width) / 2, 0, HEIGHT / 2));
    this.hinge.add(box(width - 0.14, 0.07, HEIGHT * 0.94, this.material, (width - 0.14) / 2, 0, HEIGHT * 0.48));
    this.hinge.position.set(-(width - 0.14) / 2, 0, 0);
    this.hinge.add(box(0.07, 0.2, 0.07, frame, width - 0.34, 0, HEIGHT * 0.5));
    this.solid.add(this.hinge);
  }

  override show(status: Status, gone: number): void {
    super.show(status, 0);
    this.solid.rotation.z = this.turned;
    this.hinge.rotation.z = gone * 1.5 * this.opens;
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
    const carried = new Map<Body, number>();
    this.run.obstacles.forEach((obstacle, i) => {
      const status = at(obstacle.status, tick)[1];
      const thing = this.things[i]!;
      const carrier = this.bodies[at(obstacle.carried, tick)[1][0] ?? -1];
      thing.show(status, carrier ? 0 : this.resolved(obstacle, status, seconds));
      if (!carrier) return;
      const below = carried.get(carrier) ?? 0;
      thing.carry(carrier, below);
      carried.set(carrier, below + 1);
    });
  }

  private made(obstacle: Obstacle): Block {
    const { run, motion } = this;
    const [x, y] = centreOf(run, motion.side, obstacle.region);
    if (obstacle.action !== "push" && !/(^|[_-])(door|gate)$/.test(obstacle.type)) return new Block(x, y, motion.side / 2).fill(obstacle.shape);
    const free = (region: number): boolean => region >= 0 && region < run.rows * run.cols && !isWall(run, region);
    const northSouth = free(obstacle.region - run.cols) && free(obstacle.region + run.cols);
    return new Door(x, y, motion.side, northSouth ? 0 : Math.PI / 2, this.away(obstacle, northSouth));
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
