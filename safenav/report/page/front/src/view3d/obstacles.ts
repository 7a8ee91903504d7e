/**
 * Hidden obstacles in the scene: a door whose leaf swings open as it is pushed, fog that lifts
 * when it is sensed, and a heap for types that have no picture of their own. What nobody has met
 * yet is a faint outline.
 */

import { BoxGeometry, Color, DoubleSide, EdgesGeometry, Group, IcosahedronGeometry, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial } from "three";
import { at, type Obstacle, type Run, type Status } from "../run/run";
import { themeColour } from "./colours";
import { centreOf, isWall } from "./floor";
import { sampleAt, type Motion, type Sampled } from "./motion";

const HEIGHT = 1.5;

/** One obstacle; `gone` runs from 0 to 1 while it is being resolved. */
abstract class Thing {
  readonly group = new Group();
  private readonly outline: LineSegments;
  protected readonly solid = new Group();

  constructor(side: number) {
    const box = new EdgesGeometry(new BoxGeometry(side * 0.86, side * 0.86, HEIGHT * 0.6));
    this.outline = new LineSegments(box, new LineBasicMaterial({ transparent: true, opacity: 0.55 }));
    this.outline.position.z = HEIGHT * 0.3;
    this.group.add(this.outline, this.solid);
  }

  show(status: Status, gone: number, hidden: boolean): void {
    this.outline.visible = status === "hidden" && hidden;
    (this.outline.material as LineBasicMaterial).color = themeColour("hidden");
    this.solid.visible = status !== "hidden" && (gone < 1 || this.stays);
    this.become(status, gone);
  }

  /** Whether something of it is left when it is resolved. */
  protected readonly stays: boolean = false;

  protected abstract become(status: Status, gone: number): void;
}

function statusColour(status: Status): Color {
  return themeColour(status === "hidden" ? "hidden" : status);
}

/** A leaf between two posts, across the way through the gap. */
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
    super(side);
    const width = side * 0.92;
    const frame = new MeshLambertMaterial({ color: 0x7b828c });
    for (const x of [-1, 1]) {
      const post = new Mesh(new BoxGeometry(0.12, 0.12, HEIGHT), frame);
      post.position.set((x * width) / 2, 0, HEIGHT / 2);
      this.solid.add(post);
    }
    const leaf = new Mesh(new BoxGeometry(width - 0.14, 0.07, HEIGHT * 0.94), this.leaf);
    leaf.position.set((width - 0.14) / 2, 0, HEIGHT * 0.48);
    const knob = new Mesh(new BoxGeometry(0.07, 0.2, 0.07), frame);
    knob.position.set(width - 0.34, 0, HEIGHT * 0.5);
    this.hinge.position.set(-(width - 0.14) / 2, 0, 0);
    this.hinge.add(leaf, knob);
    this.solid.add(this.hinge);
    this.solid.rotation.z = northSouth ? 0 : Math.PI / 2;
  }

  protected become(status: Status, gone: number): void {
    this.hinge.rotation.z = gone * 1.5 * this.opens;
    this.leaf.color = gone >= 1 ? new Color(0xb08a5a) : statusColour(status);
  }
}

/** Puffs over the region; they thin out and rise as it is sensed. */
class Fog extends Thing {
  private readonly material = new MeshLambertMaterial({ transparent: true, depthWrite: false });
  private readonly puffs: Mesh[] = [];

  constructor(side: number) {
    super(side);
    for (let i = 0; i < 9; i++) {
      const puff = new Mesh(new IcosahedronGeometry(side * (0.15 + 0.04 * (i % 3)), 2), this.material);
      puff.position.set(((i % 3) - 1) * side * 0.26, (Math.floor(i / 3) - 1) * side * 0.26, 0.28 + 0.1 * ((i * 7) % 4));
      this.puffs.push(puff);
      this.solid.add(puff);
    }
  }

  protected become(status: Status, gone: number): void {
    this.material.opacity = 0.62 * (1 - gone);
    this.material.color = statusColour(status);
    this.solid.position.z = gone * 0.6;
  }
}

/** Any other obstacle: a heap that sinks. */
class Heap extends Thing {
  private readonly material = new MeshLambertMaterial({ flatShading: true });

  constructor(side: number) {
    super(side);
    for (let i = 0; i < 7; i++) {
      const stone = new Mesh(new IcosahedronGeometry(side * (0.12 + 0.03 * (i % 3)), 0), this.material);
      const angle = i * 2.4;
      stone.position.set(Math.cos(angle) * side * 0.22, Math.sin(angle) * side * 0.22, 0.16 + 0.1 * (i % 2));
      stone.rotation.set(i, i * 2, i * 3);
      this.solid.add(stone);
    }
  }

  protected become(status: Status, gone: number): void {
    this.material.color = statusColour(status);
    this.solid.scale.setScalar(Math.max(0.001, 1 - gone));
  }
}

export class Obstacles {
  readonly group = new Group();
  private readonly things: Thing[];

  constructor(
    private readonly run: Run,
    private readonly motion: Motion,
    private readonly robots: Sampled[],
  ) {
    this.things = run.obstacles.map((obstacle) => {
      const thing = this.made(obstacle);
      const [x, y] = centreOf(run, motion.side, obstacle.region);
      thing.group.position.set(x, y, 0);
      this.group.add(thing.group);
      return thing;
    });
  }

  update(tick: number, seconds: number, hidden: boolean): void {
    this.run.obstacles.forEach((obstacle, i) => {
      const status = at(obstacle.status, tick)[1];
      this.things[i]!.show(status, this.resolved(obstacle, status, seconds), hidden);
    });
  }

  private made(obstacle: Obstacle): Thing {
    const { side } = this.motion;
    if (obstacle.type.endsWith("door") || obstacle.action === "push") {
      const { run } = this;
      const free = (region: number): boolean => region >= 0 && region < run.rows * run.cols && !isWall(run, region);
      const northSouth = free(obstacle.region - run.cols) && free(obstacle.region + run.cols);
      return new Door(side, northSouth, this.away(obstacle, northSouth));
    }
    return obstacle.action === "sense" ? new Fog(side) : new Heap(side);
  }

  /** To which side a door opens: its positive side is north, or west where the way is level. */
  private away(obstacle: Obstacle, northSouth: boolean): 1 | -1 {
    const push = this.motion.actions.find((action) => action[1] === obstacle.name);
    if (push === undefined) return 1;
    const { x, y } = sampleAt(this.motion, this.robots[push[0]]!, push[3]);
    const [doorX, doorY] = centreOf(this.run, this.motion.side, obstacle.region);
    return (northSouth ? y! - doorY : doorX - x!) > 0 ? -1 : 1;
  }

  /** How far it is resolved: it gives way during the action that resolves it. */
  private resolved(obstacle: Obstacle, status: Status, seconds: number): number {
    if (status === "blocked") return 0;
    const acts = this.motion.actions.filter((action) => action[1] === obstacle.name);
    const last = acts[acts.length - 1];
    if (last === undefined) return status === "resolved" ? 1 : 0;
    const [, , , from, to] = last;
    if (seconds >= to) return 1;
    return Math.max(0, Math.min(1, (seconds - from) / Math.max(0.01, to - from)));
  }
}
