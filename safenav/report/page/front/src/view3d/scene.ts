/** The scene of a run; `update` draws a moment. */

import { BufferGeometry, Color, DirectionalLight, Group, HemisphereLight, Line, LineBasicMaterial, Mesh, MeshBasicMaterial, PerspectiveCamera } from "three";
import { PlaneGeometry, Scene, Sprite, Vector3, WebGLRenderer, type Material } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { at, roleOf, type Run } from "../run/run";
import type { Shown } from "../settings";
import { bodyOf } from "./bodies";
import { focusAt, type Lens, type View } from "./eye";
import { centreOf, Floor } from "./floor";
import { sampleAt, type Motion, type Sampled } from "./motion";
import { Obstacles } from "./obstacles";
import { Places, tidy } from "./places";
import { FIELD_ANGLE, Notice, sign } from "./signs";
import { themeColour, type Body } from "./solids";
import { Trails } from "./trails";

const FADED = 0.3;

/** Makes a body a ghost. */
function fade(group: Group): void {
  group.traverse((found) => {
    if (!(found instanceof Mesh)) return;
    const material = (found.material as Material).clone();
    material.transparent = true;
    material.depthWrite = false;
    material.opacity *= FADED;
    found.material = material;
  });
}

/** A vertical line down from the origin. */
function stem(colour: string): Line {
  const points = [new Vector3(), new Vector3(0, 0, -1)];
  return new Line(new BufferGeometry().setFromPoints(points), new LineBasicMaterial({ color: new Color(colour) }));
}

/** The rate at which the camera turns to the action, per second. */
const STORY_PACE = 0.9;

export class RunScene implements Lens {
  readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(FIELD_ANGLE, 1, 0.1, 800);
  private readonly orbit: OrbitControls;
  private readonly floor: Floor;
  private readonly obstacles: Obstacles;
  private readonly trails: Trails;
  private readonly bodies: Body[];
  /** Translucent bodies at the planned positions of measured robots. */
  private readonly ghosts: (Body | null)[];
  private readonly notices: Notice[];
  private readonly places: Places;
  private readonly plates = new Group();
  private readonly reserved: Mesh<PlaneGeometry, MeshBasicMaterial>[] = [];
  private readonly targets = new Group();
  private targetsKey = "";
  private readonly anchors: Group[];
  /** A line of length 1 below each flyer, to the floor. */
  private readonly stems: (Line | null)[];
  private view: View = "orbit";
  /** The height of the highest flight in metres. */
  private readonly altitude: number;
  /** Whether the reader has moved the camera by hand since it was last placed. */
  private touched = false;
  /** The time that was drawn last, in seconds. */
  private moment = 0;

  constructor(
    canvas: HTMLCanvasElement,
    private readonly run: Run,
    private readonly motion: Motion,
    private readonly robots: Sampled[],
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.maxPolarAngle = Math.PI * 0.49;
    this.orbit.addEventListener("start", () => (this.touched = true));
    const flights = robots.filter(({ track }) => track.kind === "flyer").map(({ columns }) => columns.get("z")!);
    this.altitude = Math.max(0, ...flights.map((heights) => heights.reduce((most, z) => Math.max(most, z))));
    const colours = run.robots.map((robot) => robot.look.colour);
    this.floor = new Floor(run, motion.side);
    this.trails = new Trails(motion, robots, colours);
    const made = ({ track }: Sampled, i: number): Body =>
      bodyOf(track.kind, track.size, run.robots[i]!);
    this.bodies = robots.map(made);
    this.obstacles = new Obstacles(run, motion, robots, this.bodies);
    this.ghosts = robots.map((robot, i) => {
      if (robot.ghost === null) return null;
      const body = made(robot, i);
      fade(body.group);
      this.scene.add(body.group);
      return body;
    });
    this.places = new Places(run, motion.side);
    this.anchors = this.bodies.map(() => new Group());
    this.stems = robots.map(({ track }, i) => (track.kind === "flyer" ? stem(run.robots[i]!.look.colour) : null));
    this.stems.forEach((line, i) => line && this.anchors[i]!.add(line));
    this.notices = run.robots.map(
      (robot, i) =>
        new Notice(
          (sprite) => {
            sprite.position.z = this.bodies[i]!.top;
            this.anchors[i]!.add(sprite);
          },
          () => ({ ink: robot.look.ink, paper: robot.look.colour, height: 0.038, anchor: -0.9 }),
        ),
    );
    run.robots.forEach((robot, i) => {
      const name = sign(robot.name, { ink: "#fff", paper: "rgba(20,24,30,0.72)", height: 0.032, anchor: 0 });
      name.position.z = this.bodies[i]!.top;
      this.anchors[i]!.add(name);
    });
    for (const colour of colours) {
      const material = new MeshBasicMaterial({ color: new Color(colour), transparent: true, opacity: 0.2, depthWrite: false });
      for (let i = 0; i < 3; i++) {
        const plate = new Mesh(new PlaneGeometry(motion.side * 0.97, motion.side * 0.97), material);
        plate.position.z = 0.004;
        this.reserved.push(plate);
        this.plates.add(plate);
      }
    }
    const sun = new DirectionalLight(0xffffff, 1.7);
    sun.position.set(-4, -7, 12);
    this.scene.add(new HemisphereLight(0xffffff, 0x8a8f98, 1.7), sun);
    this.scene.add(this.floor.group, this.places.group, this.plates, this.targets, this.obstacles.group, this.trails.group);
    this.scene.add(...this.bodies.map((body) => body.group), ...this.anchors);
    this.home();
    this.recolour();
  }

  recolour(): void {
    this.scene.background = themeColour("page");
    this.floor.recolour();
    this.places.recolour();
  }

  resize(width: number, height: number): void {
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!this.touched) this.look(this.view);
  }

  look(view: View): void {
    this.view = view;
    this.touched = false;
    this.home();
  }

  /** The initial position of the camera in the present view. */
  private home(): void {
    const [west, south, east, north] = this.floor.extent;
    const [width, depth] = [east - west, north - south];
    const high = this.altitude;
    const target: [number, number, number] = [(west + east) / 2, (south + north) / 2, high / 2];
    const angle = (this.camera.fov * Math.PI) / 360;
    const aspect = this.camera.aspect;
    if (this.view === "top") {
      const away = Math.max(depth / 2, width / 2 / aspect) / Math.tan(angle) + high;
      this.orbit.target.set(...target);
      this.camera.position.set(target[0], target[1] - 0.001, away * 1.04);
    } else if (this.view === "orbit") {
      // Seen at 50 degrees from the horizon; the near edge is wider than the middle.
      const away = Math.max(depth * 0.4 + high * 0.4, (width * 0.5) / aspect) / Math.tan(angle) + depth * 0.32 + high * 0.4;
      this.orbit.target.set(target[0], target[1] - depth * 0.03, target[2]);
      this.camera.position.set(target[0], target[1] - away * 0.643, target[2] + away * 0.766);
    } else if (this.view === "story") {
      this.frameStory(1);
    } else {
      const { x, y, z } = this.sample(this.view, this.moment);
      const high = this.robots[this.view]!.track.kind === "flyer" ? z! : 0.8;
      this.orbit.target.set(x!, y!, high);
      this.camera.position.set(x! - 3.4, y! - 5.2, high + 3.4);
    }
    this.orbit.update();
  }

  /** Move the camera by a part (0 to 1) of its path to a view of the story's subject. */
  private frameStory(part: number): void {
    const points = focusAt(this.run, this.motion, this.moment, (robot) => {
      const { x, y } = this.sample(robot, this.moment);
      return [x!, y!];
    });
    const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => y)];
    const [west, east, south, north] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const reach = Math.max(east - west, (north - south) * this.camera.aspect, 5 * this.motion.side) + 2 * this.motion.side;
    const away = reach / 2 / this.camera.aspect / Math.tan((this.camera.fov * Math.PI) / 360) + reach * 0.15;
    const target = new Vector3((west + east) / 2, (south + north) / 2, 0);
    this.orbit.target.lerp(target, part);
    this.camera.position.lerp(target.clone().add(new Vector3(0, -0.6 * away, 0.8 * away)), part);
  }

  private sample(robot: number, seconds: number): Record<string, number> {
    return sampleAt(this.motion, this.robots[robot]!, seconds);
  }

  /** Draw a moment; the robots' knowledge is that of the tick. */
  update(seconds: number, tick: number, shown: Shown): void {
    const before = this.view;
    if (typeof before === "number") {
      const from = this.sample(before, this.moment);
      const to = this.sample(before, seconds);
      const [dx, dy] = [to.x! - from.x!, to.y! - from.y!];
      this.orbit.target.x += dx;
      this.orbit.target.y += dy;
      this.camera.position.x += dx;
      this.camera.position.y += dy;
    }
    const passed = Math.abs(seconds - this.moment);
    this.moment = seconds;
    if (before === "story") this.frameStory(passed > 3 ? 1 : 1 - Math.exp(-STORY_PACE * passed));
    this.run.robots.forEach((_, i) => {
      const sample = this.sample(i, seconds);
      const body = this.bodies[i]!;
      body.pose(sample, seconds);
      const { ghost } = this.robots[i]!;
      if (ghost !== null) this.ghosts[i]!.pose(sampleAt(this.motion, { columns: ghost }, seconds), seconds);
      const base = this.robots[i]!.track.kind === "flyer" ? sample.z! : 0;
      this.anchors[i]!.position.set(sample.x!, sample.y!, base);
      this.stems[i]?.scale.setZ(Math.max(1e-3, base));
    });
    this.obstacles.update(tick, seconds, shown.hidden);
    this.trails.group.visible = shown.trails;
    if (shown.trails) this.trails.update(seconds);
    this.showReserved(seconds, shown.numbers);
    this.showNotices(tick, seconds);
    this.showTargets(tick, shown.targets);
    this.orbit.update();
    this.scene.updateMatrixWorld();
    this.places.group.visible = shown.names;
    tidy([...this.signs(), ...(shown.names ? this.places.nearest(this.camera) : [])], this.camera, this.renderer.domElement);
    this.renderer.render(this.scene, this.camera);
  }

  /** Return the signs by priority: names of robots (the followed one, then the nearest), their activities, targets. */
  private signs(): Sprite[] {
    const away = (anchor: Group): number =>
      anchor === this.anchors[Number(this.view)] ? 0 : anchor.position.distanceTo(this.camera.position);
    const anchors = [...this.anchors].sort((a, b) => away(a) - away(b));
    const rows = anchors.map((anchor) => anchor.children.filter((found) => found instanceof Sprite));
    const flags = this.targets.visible ? this.targets.children.filter((found) => found instanceof Sprite) : [];
    return [...rows.map(([name]) => name!), ...rows.flatMap(([, notice]) => notice ?? []), ...flags];
  }

  /** Tint the reserved regions: those that robots leave and enter. */
  private showReserved(seconds: number, shown: boolean): void {
    for (const plate of this.reserved) plate.visible = false;
    if (!shown) return;
    const used = new Array<number>(this.run.robots.length).fill(0);
    for (const [robot, region, from, to] of this.motion.reserved) {
      if (seconds < from || seconds >= to || used[robot]! >= 3) continue;
      const plate = this.reserved[robot * 3 + used[robot]!++]!;
      const [x, y] = centreOf(this.run, this.motion.side, region);
      plate.position.set(x, y, 0.004 + robot * 0.0005);
      plate.visible = true;
    }
  }

  /** Show roles and present actions above the robots. */
  private showNotices(tick: number, seconds: number): void {
    const frames = at(this.run.stack, tick)[1];
    const words = this.run.robots.map((robot) => roleOf(robot.name, frames)?.[1] ?? "");
    for (const [robot, obstacle, action, from, to] of this.motion.actions) {
      if (seconds < from || seconds >= to) continue;
      words[robot] = `${action}: ${this.run.obstacles.find((one) => one.name === obstacle)?.label ?? obstacle}`;
    }
    words.forEach((text, i) => this.notices[i]!.show(text));
  }

  private showTargets(tick: number, shown: boolean): void {
    this.targets.visible = shown;
    const wanted = this.run.robots.map((robot) => at(robot.tasks, tick)[2]);
    const key = JSON.stringify(wanted);
    if (key === this.targetsKey) return;
    this.targetsKey = key;
    this.targets.clear();
    const slots = new Map<number, number>();
    wanted.forEach((regions, i) => {
      const look = this.run.robots[i]!.look;
      const areas = Object.values(this.run.areas).filter((area) => area.every((region) => regions.includes(region)));
      const alone = regions.filter((region) => areas.every((area) => !area.includes(region)));
      for (const region of [...areas.map((area) => area[0]!), ...alone.slice(0, 40)]) {
        const slot = slots.get(region) ?? 0;
        slots.set(region, slot + 1);
        const flag = sign(look.letters, { ink: look.ink, paper: look.colour, height: 0.034 });
        const [x, y] = centreOf(this.run, this.motion.side, region);
        const { side } = this.motion;
        flag.position.set(x + side * (0.34 - 0.2 * slot), y - side * 0.36, 0.22);
        this.targets.add(flag);
      }
    });
  }

  /** Call back whenever the user moves the camera. */
  onTouch(listener: () => void): () => void {
    this.orbit.addEventListener("change", listener);
    return () => this.orbit.removeEventListener("change", listener);
  }

  /** Nearer or farther by a factor. */
  dolly(factor: number): void {
    this.touched = true;
    const { target } = this.orbit;
    this.camera.position.sub(target).multiplyScalar(factor).add(target);
  }

  /** Moves the map by dx and dy pixels, along the ground. */
  slide(dx: number, dy: number): void {
    this.touched = true;
    const away = this.camera.position.distanceTo(this.orbit.target);
    const metres = (2 * away * Math.tan((FIELD_ANGLE * Math.PI) / 360)) / this.renderer.domElement.clientHeight;
    for (const point of [this.orbit.target, this.camera.position]) {
      point.x -= dx * metres;
      point.y += dy * metres;
    }
  }

  /** Turn the camera to a column and row. */
  aim(x: number, y: number): void {
    const { side } = this.motion;
    const [east, north] = [(x + 0.5) * side, (this.run.rows - y - 0.5) * side];
    const [dx, dy] = [east - this.orbit.target.x, north - this.orbit.target.y];
    this.touched = true;
    for (const point of [this.orbit.target, this.camera.position]) {
      point.x += dx;
      point.y += dy;
    }
  }

  dispose(): void {
    this.orbit.dispose();
    this.renderer.dispose();
  }
}
