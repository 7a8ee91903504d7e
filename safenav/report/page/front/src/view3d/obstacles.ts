/** The obstacles of a run in the scene, at any moment. */

import { Group } from "three";
import { at, isWall, loadsOf, tickAt, type Obstacle, type Run, type Status } from "../run/run";
import { centreOf } from "./floor";
import { sampleAt, type Motion, type Sampled } from "./motion";
import { Block, Door, Fog, type Held, type Thing } from "./things";

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

  update(tick: number, seconds: number, hidden: boolean): void {
    this.tick = tick;
    this.run.obstacles.forEach((obstacle, i) => {
      const status = at(obstacle.status, tick)[1];
      const thing = this.things[i]!;
      const carriers = at(obstacle.carried, tick)[1];
      thing.show(status, carriers.length > 0 ? 0 : this.resolved(obstacle, status, seconds), hidden);
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
