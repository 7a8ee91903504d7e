/**
 * The scene of a run; `update` draws a moment. Its floor is the flat map as a picture, so that both show the same
 * regions, names, obstacles and targets. The scene is the eye of its page.
 */

import { BoxGeometry, BufferGeometry, Color, DirectionalLight, Group, HemisphereLight, InstancedMesh, Line, LineBasicMaterial, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, PlaneGeometry, Scene, SRGBColorSpace, Texture, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { CSS2DObject, CSS2DRenderer } from "three/examples/jsm/renderers/CSS2DRenderer.js";
import { CELL, type Eye } from "../map/camera";
import { at, dark, type EventKind, isWall, type Run } from "../run/run";
import { bodyOf, themeColour, type Body } from "./bodies";
import { centreOf, Footprints, type Motion, sampleAt, type Sampled } from "./motion";
import { Obstacles } from "./obstacles";

/** Around the map, following the story, or following the robot with that index. */
export type View = "orbit" | "story" | number;

/** Vertical angle of view of the camera in degrees, and the height of the picture at one metre. */
const FIELD_ANGLE = 38;
const FIELD = 2 * Math.tan((FIELD_ANGLE * Math.PI) / 360);
const WALL = 0.18;
/** The direction of the camera, at 50 degrees from the horizon. */
const SLANTED = new Vector3(0, -0.643, 0.766);
/** The rate at which the camera turns to the action, per second. */
const STORY_PACE = 0.9;
/** Seconds by which the camera turns to an event before it happens. */
const AHEAD = 2;
const TURNING: ReadonlySet<EventKind> = new Set(["violation", "request", "resolved", "blocked", "outcome"]);
/** Most pixels of a side of the floor's picture. */
const MOST_PIXELS = 4096;

type Point = [x: number, y: number];

/** Low walls, so that nothing hides behind them. */
function wallsOf(run: Run, side: number): InstancedMesh<BoxGeometry, MeshLambertMaterial> {
  const regions = [...Array(run.rows * run.cols).keys()].filter((region) => isWall(run, region));
  const walls = new InstancedMesh(new BoxGeometry(side, side, WALL), new MeshLambertMaterial(), regions.length);
  regions.forEach((region, i) => walls.setMatrixAt(i, new Matrix4().makeTranslation(...centreOf(run, side, region), WALL / 2)));
  return walls;
}

/** The positions of robots and obstacles during the run, in metres. */
function placesOf(run: Run, side: number, robots: Sampled[]): Point[] {
  const ends = (values: Float32Array): [number, number] => [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];
  const moved = robots.flatMap(({ columns }): Point[] => {
    const [[west, east], [south, north]] = [ends(columns.get("x")!), ends(columns.get("y")!)];
    return [[west, south], [east, north]];
  });
  return [...moved, ...run.obstacles.map(({ region }) => centreOf(run, side, region))];
}

/** A vertical line down from the origin. */
function stem(colour: string): Line {
  const points = [new Vector3(), new Vector3(0, 0, -1)];
  return new Line(new BufferGeometry().setFromPoints(points), new LineBasicMaterial({ color: new Color(colour) }));
}

/** The name of a robot, above it. */
class Sign {
  readonly anchor = new Group();
  readonly name = new CSS2DObject(document.createElement("p"));

  constructor(height: number) {
    this.name.center.set(0.5, 1);
    this.name.position.z = height;
    this.anchor.add(this.name);
  }
}

function overlap(a: DOMRect, b: DOMRect): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

export class RunScene implements Eye {
  readonly renderer: WebGLRenderer;
  /** The words over the picture. */
  readonly words = new CSS2DRenderer();
  view: View = "orbit";
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(FIELD_ANGLE, 1, 0.1, 800);
  private readonly orbit: OrbitControls;
  private readonly places: Point[];
  private readonly walls: InstancedMesh<BoxGeometry, MeshLambertMaterial>;
  private readonly floor: Mesh<PlaneGeometry, MeshBasicMaterial>;
  private readonly obstacles: Obstacles;
  private readonly prints: Footprints[];
  private readonly bodies: Body[];
  private readonly signs: Sign[];
  /** A line of length 1 below each flyer, to the floor. */
  private readonly stems: (Line | null)[];
  /** The height of the highest flight in metres. */
  private readonly altitude: number;
  private readonly listeners = new Set<() => void>();
  /** Whether the reader has moved the camera since it was last placed. */
  private touched = false;
  /** The time that was drawn last, in seconds. */
  private moment = 0;
  /** The next picture of the floor, while one is being read. */
  private pending: string | null = null;
  private reading = false;

  constructor(
    private readonly run: Run,
    private readonly motion: Motion,
    private readonly robots: Sampled[],
  ) {
    const canvas = document.createElement("canvas");
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.maxPolarAngle = Math.PI * 0.49;
    this.orbit.addEventListener("start", () => (this.touched = true));
    this.orbit.addEventListener("change", () => this.changed());
    const { side } = motion;
    const heights = robots.filter(({ track }) => track.kind === "flyer").map(({ columns }) => columns.get("z")!);
    this.altitude = Math.max(0, ...heights.map((flight) => flight.reduce((most, z) => Math.max(most, z))));
    this.places = placesOf(run, side, robots);
    this.walls = wallsOf(run, side);
    this.floor = new Mesh(new PlaneGeometry(run.cols * side, run.rows * side), new MeshBasicMaterial());
    this.floor.position.set((run.cols * side) / 2, (run.rows * side) / 2, 0);
    this.prints = robots.map(({ track }, i) => new Footprints(track, run.robots[i]!.look.colour));
    this.bodies = robots.map(({ track }, i) => bodyOf(track.kind, track.size, run.robots[i]!));
    this.obstacles = new Obstacles(run, motion, robots, this.bodies);
    this.signs = this.bodies.map(({ top }) => new Sign(top));
    this.stems = robots.map(({ track }, i) => (track.kind === "flyer" ? stem(run.robots[i]!.look.colour) : null));
    this.stems.forEach((line, i) => line && this.signs[i]!.anchor.add(line));
    const sun = new DirectionalLight(0xffffff, 1.7);
    sun.position.set(-4, -7, 12);
    this.scene.add(new HemisphereLight(0xffffff, 0x8a8f98, 1.7), sun, this.floor, this.walls, this.obstacles.group, ...this.prints.map(({ mesh }) => mesh));
    this.scene.add(...this.bodies.map((body) => body.group), ...this.signs.map(({ anchor }) => anchor));
    this.recolour();
    dark.addEventListener("change", () => this.recolour());
    this.home();
  }

  private recolour(): void {
    this.scene.background = themeColour("page");
    this.walls.material.color = themeColour("wall");
    this.changed();
  }

  /** Show a drawing of the flat map on the floor; `scale`: pixels of a region. */
  paint(map: SVGSVGElement, scale: number): void {
    const { rows, cols } = this.run;
    const pixels = Math.min(2 * scale, MOST_PIXELS / Math.max(rows, cols));
    const copy = map.cloneNode(true) as SVGSVGElement;
    const style = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]).map((rule) => rule.cssText);
    copy.prepend(Object.assign(document.createElementNS(copy.namespaceURI, "style"), { textContent: style.join("") }));
    copy.removeAttribute("class"); // it hides the drawing on the page
    copy.setAttribute("style", `color-scheme: ${dark.matches ? "dark" : "light"}; font-family: ${getComputedStyle(document.body).fontFamily}`);
    copy.setAttribute("viewBox", `0 0 ${cols * CELL} ${rows * CELL}`);
    copy.setAttribute("width", String(Math.round(cols * pixels)));
    copy.setAttribute("height", String(Math.round(rows * pixels)));
    this.pending = `data:image/svg+xml,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
    if (!this.reading) void this.read();
  }

  /** Read the newest picture of the floor; a busy machine leaves out those before it. */
  private async read(): Promise<void> {
    this.reading = true;
    while (this.pending !== null) {
      const image = new Image();
      image.src = this.pending;
      this.pending = null;
      if (await image.decode().then(() => false, () => true)) continue;
      this.floor.material.map?.dispose();
      const map = (this.floor.material.map = new Texture(image));
      map.colorSpace = SRGBColorSpace;
      map.needsUpdate = this.floor.material.needsUpdate = true;
      this.changed();
    }
    this.reading = false;
  }

  resize(width: number, height: number): void {
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.words.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!this.touched) this.home();
  }

  // The eye of the page.

  get followed(): number | null {
    return typeof this.view === "number" ? this.view : null;
  }

  get isWhole(): boolean {
    return this.followed === null && this.view !== "story" && !this.touched;
  }

  onChange(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  private changed(): void {
    for (const listener of this.listeners) listener();
  }

  choose(view: View): void {
    this.view = view;
    this.touched = false;
    this.home();
    this.changed();
  }

  fit(): void {
    this.choose("orbit");
  }

  follow(robot: number | null): void {
    this.choose(robot ?? "orbit");
  }

  zoom(factor: number): void {
    const { target } = this.orbit;
    this.camera.position.sub(target).divideScalar(factor).add(target);
    this.shift(0, 0);
  }

  pan(dx: number, dy: number): void {
    const away = this.camera.position.distanceTo(this.orbit.target);
    const metres = (away * FIELD) / this.renderer.domElement.clientHeight;
    this.shift(-dx * metres, dy * metres);
  }

  show(x: number, y: number): void {
    if (this.view === "story") return;
    const [east, north] = [(x + 0.5) * this.motion.side, (this.run.rows - y - 0.5) * this.motion.side];
    this.shift(east - this.orbit.target.x, north - this.orbit.target.y);
  }

  /** Move the camera along the ground, in metres. */
  private shift(dx: number, dy: number): void {
    this.touched = true;
    this.carry(dx, dy);
    this.changed();
  }

  private carry(dx: number, dy: number): void {
    for (const point of [this.orbit.target, this.camera.position]) {
      point.x += dx;
      point.y += dy;
    }
  }

  /** The initial position of the camera in the present view. */
  private home(): void {
    if (this.view === "orbit") this.frame(this.places);
    else if (this.view === "story") this.frame(this.subject());
    else {
      const { x, y, z } = this.sample(this.view, this.moment);
      const high = this.robots[this.view]!.track.kind === "flyer" ? z! : 0.8;
      this.orbit.target.set(x!, y!, high);
      this.camera.position.set(x! - 3.4, y! - 5.2, high + 3.4);
    }
    this.orbit.update();
  }

  /** Move the camera by a part (0 to 1) of its path to where places and the regions around them fill the picture. */
  private frame(places: Point[], part = 1): void {
    const margin = 0.85 * this.motion.side;
    const [xs, ys] = [places.map(([x]) => x), places.map(([, y]) => y)];
    const [west, east, south, north] = [Math.min(...xs) - margin, Math.max(...xs) + margin, Math.min(...ys) - margin, Math.max(...ys) + margin];
    const corners = [west, east].flatMap((x) => [new Vector3(x, south, 0), new Vector3(x, north, 0), new Vector3(x, north, this.altitude)]);
    const target = new Vector3((west + east) / 2, (south + north) / 2, 0);
    const eye = this.camera.clone();
    let away = 2 * Math.hypot(east - west, north - south);
    for (let i = 0; i < 20; i++) {
      eye.position.copy(target).addScaledVector(SLANTED, away);
      eye.lookAt(target);
      eye.updateMatrixWorld();
      const seen = corners.map((corner) => corner.clone().project(eye));
      const [low, high] = [Math.min(...seen.map(({ y }) => y)), Math.max(...seen.map(({ y }) => y))];
      target.y += ((low + high) / 4) * away * FIELD * 0.5;
      away *= Math.max((high - low) / 2, ...seen.map(({ x }) => Math.abs(x))) ** 0.7;
    }
    this.orbit.target.lerp(target, part);
    this.camera.position.lerp(target.addScaledVector(SLANTED, away), part);
  }

  /**
   * Return the subject of the story now, as points in metres: the robots and obstacle of an open request, else the
   * place and robot of the last important event, else all robots.
   */
  private subject(): Point[] {
    const { run } = this;
    const robotAt = (_: unknown, robot: number): Point => {
      const { x, y } = this.sample(robot, this.moment);
      return [x!, y!];
    };
    const told = run.events.filter((event) => TURNING.has(event[1]) && run.times![event[0]]! <= this.moment + AHEAD);
    const last = told[told.length - 1];
    if (last === undefined || last[1] === "outcome") return run.robots.map(robotAt);
    const involved = new Set(at(run.stack, last[0])[1].flatMap(([, requester, helpers]) => [requester ?? "", ...helpers]));
    const points = run.robots.flatMap((robot, i) => (i === last[3] || involved.has(robot.name) ? [robotAt(robot, i)] : []));
    if (last[4] >= 0) points.push(centreOf(run, this.motion.side, last[4]));
    return points.length > 0 ? points : run.robots.map(robotAt);
  }

  private sample(robot: number, seconds: number): Record<string, number> {
    return sampleAt(this.motion, this.robots[robot]!, seconds);
  }

  /** Draw a moment; the robots' knowledge is that of the tick. */
  update(seconds: number, tick: number): void {
    if (typeof this.view === "number") {
      const [from, to] = [this.sample(this.view, this.moment), this.sample(this.view, seconds)];
      this.carry(to.x! - from.x!, to.y! - from.y!);
    }
    const passed = Math.abs(seconds - this.moment);
    this.moment = seconds;
    if (this.view === "story") this.frame(this.subject(), passed > 3 ? 1 : 1 - Math.exp(-STORY_PACE * passed));
    this.robots.forEach(({ track }, i) => {
      const sample = this.sample(i, seconds);
      this.bodies[i]!.pose(sample);
      const base = track.kind === "flyer" ? sample.z! : 0;
      this.signs[i]!.anchor.position.set(sample.x!, sample.y!, base);
      const { name, out } = this.run.robots[i]!;
      this.signs[i]!.name.element.textContent = at(out, tick)[1] ? `${name}, out of service` : name;
      this.stems[i]?.scale.setZ(Math.max(1e-3, base));
    });
    this.obstacles.update(tick, seconds);
    for (const prints of this.prints) prints.update(seconds);
    this.orbit.update();
    this.renderer.render(this.scene, this.camera);
    this.words.render(this.scene, this.camera);
    this.tidy();
  }

  /** Hide each name that would cover an earlier one: the followed robot comes before the nearest. */
  private tidy(): void {
    const away = (of: Sign): number =>
      of === this.signs[Number(this.view)] ? 0 : of.anchor.position.distanceTo(this.camera.position);
    const rows = [...this.signs].sort((a, b) => away(a) - away(b));
    const placed: DOMRect[] = [];
    for (const { element } of rows.map(({ name }) => name)) {
      const box = element.getBoundingClientRect();
      const hidden = placed.some((other) => overlap(box, other));
      element.style.visibility = hidden ? "hidden" : "";
      if (!hidden) placed.push(box);
    }
  }
}
