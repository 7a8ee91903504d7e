/** Robots from simple solids by their kind of motion, posed from samples of it. */

import { BoxGeometry, type BufferGeometry, CanvasTexture, CapsuleGeometry, CircleGeometry, Color, CylinderGeometry, Group, type Material, Mesh, MeshBasicMaterial, MeshLambertMaterial, PlaneGeometry, SphereGeometry, TorusGeometry, Vector3 } from "three";
import { dark, type Robot } from "../run/run";
import type { Kind, Sample } from "./motion";

export interface Body {
  readonly group: Group;
  /** The height of signs above the robot, in metres above its group. */
  readonly top: number;
  pose(sample: Sample): void;
}

const DARK = 0x2b3038;
const GLASS = 0x8fd3ff;

type Role = "page" | "wall" | "hidden" | "found" | "requested" | "resolved" | "blocked";

/** A colour of the page: the stylesheet has both of each, `light-dark(#…, #…)`. */
export function themeColour(role: Role): Color {
  const [light, night] = getComputedStyle(document.documentElement).getPropertyValue(`--${role}`).match(/#\w+/g)!;
  return new Color(dark.matches ? night : light);
}

export function paint(colour: string | number): MeshLambertMaterial {
  return new MeshLambertMaterial({ color: new Color(colour) });
}

export function solid(geometry: BufferGeometry, material: Material, x = 0, y = 0, z = 0): Mesh {
  const mesh = new Mesh(geometry, material);
  mesh.position.set(x, y, z);
  return mesh;
}

/** A box of a size, at a place. */
export function box(wide: number, deep: number, high: number, material: Material, x = 0, y = 0, z = 0): Mesh {
  return solid(new BoxGeometry(wide, deep, high), material, x, y, z);
}

/** A cylinder that stands. */
function upright(radius: number, height: number, material: Material, x = 0, y = 0, z = 0, foot = radius, sides = 24): Mesh {
  return solid(new CylinderGeometry(radius, foot, height, sides).rotateX(Math.PI / 2), material, x, y, z);
}

/** A rounded column that stands. */
function column(radius: number, height: number, material: Material, x = 0, y = 0, z = 0): Mesh {
  return solid(new CapsuleGeometry(radius, height, 4, 12).rotateX(Math.PI / 2), material, x, y, z);
}

/** A pictogram of the page, which lies on a surface. */
export function pictogram(path: string, side: number, z: number): Mesh<PlaneGeometry, MeshBasicMaterial> {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 128;
  const brush = canvas.getContext("2d")!;
  brush.fillStyle = "#fff";
  brush.setTransform(60, 0, 0, 60, 64, 64);
  brush.fill(new Path2D(path), "evenodd");
  const material = new MeshBasicMaterial({ map: new CanvasTexture(canvas), transparent: true, depthWrite: false });
  const plate = new Mesh(new PlaneGeometry(side, side), material);
  plate.position.z = z;
  return plate;
}

const UP = new Vector3(0, 0, 1);

export function bodyOf(kind: Kind, size: number, robot: Robot): Body {
  if (kind === "walker") return new Biped(robot.look.colour);
  return kind === "flyer" ? new Quadrotor(size, robot.look.colour) : new Cart(size, robot, kind === "rover");
}

/** A limb between two points: a cylinder of unit length along z, stretched and turned. */
class Limb {
  readonly mesh: Mesh;
  private readonly along = new Vector3();

  constructor(radius: number, material: Material) {
    const geometry = new CylinderGeometry(radius, radius * 0.8, 1, 10).rotateX(Math.PI / 2);
    this.mesh = new Mesh(geometry, material);
  }

  span(from: Vector3, to: Vector3): void {
    this.along.subVectors(to, from);
    const length = this.along.length();
    this.mesh.position.addVectors(from, to).multiplyScalar(0.5);
    this.mesh.scale.set(1, 1, length);
    if (length > 1e-6) this.mesh.quaternion.setFromUnitVectors(UP, this.along.divideScalar(length));
  }
}

/** Two links from `root` to `tip`; the joint lies on the side of `bend`. Lengths are equal. */
function joint(root: Vector3, tip: Vector3, length: number, bend: Vector3): Vector3 {
  const way = new Vector3().subVectors(tip, root);
  const half = Math.min(way.length() / 2, length * 0.9999);
  const out = Math.sqrt(length * length - half * half);
  const unit = way.normalize();
  const side = bend.clone().addScaledVector(unit, -bend.dot(unit)).normalize();
  return root.clone().addScaledVector(unit, half).addScaledVector(side, out);
}

const LINK = 0.44;
const HIP = 0.1;
const ANKLE = 0.07;
const PELVIS = 0.06;

/** Digit-like: knees bend backwards. */
class Biped implements Body {
  readonly group = new Group();
  readonly top = 1.75;
  private readonly torso = new Group();
  private readonly feet: Mesh[];
  private readonly legs: [Limb, Limb][];

  constructor(colour: string) {
    const [skin, dark] = [paint(colour), paint(DARK)];
    const trunk = column(0.14, 0.34, skin, 0, 0, 0.42);
    trunk.scale.set(0.85, 1.15, 1);
    const pelvis = box(0.18, 0.28, 0.12, dark);
    const head = box(0.14, 0.2, 0.14, dark, 0.02, 0, 0.82);
    this.torso.add(trunk, pelvis, head);
    this.feet = [0, 1].map(() => box(0.2, 0.09, 0.05, dark));
    this.legs = [0, 1].map(() => [new Limb(0.06, skin), new Limb(0.045, dark)]);
    this.group.add(this.torso, ...this.feet);
    for (const limbs of this.legs) this.group.add(limbs[0].mesh, limbs[1].mesh);
  }

  pose(sample: Sample): void {
    const yaw = sample.yaw!;
    const forward = new Vector3(Math.cos(yaw), Math.sin(yaw), 0);
    const left = new Vector3(-forward.y, forward.x, 0);
    const feet = ["l", "r"].map((s) => new Vector3(sample[`${s}x`], sample[`${s}y`], sample[`${s}z`]));
    const hips = new Vector3(sample.x, sample.y, sample.z! - PELVIS);
    // The pelvis sinks where a stride is longer than the legs at the height of the model.
    for (const [i, foot] of feet.entries()) {
      const hip = hips.clone().addScaledVector(left, i === 0 ? HIP : -HIP);
      const flat = Math.hypot(hip.x - foot.x, hip.y - foot.y);
      const most = foot.z + ANKLE + Math.sqrt(Math.max(0.01, (1.98 * LINK) ** 2 - flat * flat));
      hips.z = Math.min(hips.z, most);
    }
    this.torso.position.copy(hips);
    this.torso.rotation.set(0, 0, yaw);
    for (const [i, foot] of feet.entries()) {
      const sign = i === 0 ? 1 : -1;
      const turn = sample[i === 0 ? "lyaw" : "ryaw"]!;
      this.feet[i]!.position.set(foot.x, foot.y, foot.z + 0.025);
      this.feet[i]!.rotation.set(0, 0, turn);
      const hip = hips.clone().addScaledVector(left, sign * HIP);
      const ankle = foot.clone().setZ(foot.z + ANKLE);
      const knee = joint(hip, ankle, LINK, forward.clone().negate());
      this.legs[i]![0].span(hip, knee);
      this.legs[i]![1].span(knee, ankle);
    }
  }
}

/** Four rotors on a cross; tilts as it flies. */
class Quadrotor implements Body {
  readonly group = new Group();
  readonly top = 0.45;
  private readonly frame = new Group();

  constructor(size: number, colour: string) {
    const reach = Math.max(0.18, size / 2) * 0.72;
    const radius = reach * 0.55;
    const dark = paint(DARK);
    const blade = new MeshBasicMaterial({ color: new Color(colour), transparent: true, opacity: 0.35, depthWrite: false });
    const skin = paint(colour);
    this.frame.add(solid(new SphereGeometry(reach * 0.42, 16, 10).scale(1.2, 0.9, 0.5), skin));
    for (let i = 0; i < 4; i++) {
      const angle = Math.PI / 4 + (i * Math.PI) / 2;
      const [x, y] = [Math.cos(angle) * reach, Math.sin(angle) * reach];
      const arm = new Limb(reach * 0.06, dark);
      arm.span(new Vector3(), new Vector3(x, y, 0.02));
      const disc = solid(new CircleGeometry(radius, 20), blade, x, y, 0.045);
      this.frame.add(arm.mesh, disc, solid(new TorusGeometry(radius, reach * 0.04, 6, 24), dark, x, y, 0.04));
    }
    this.group.add(this.frame);
  }

  pose(sample: Sample): void {
    this.frame.position.set(sample.x!, sample.y!, sample.z!);
    this.frame.quaternion.set(sample.qx ?? 0, sample.qy ?? 0, sample.qz ?? 0, sample.qw ?? 1).normalize();
    if (sample.qw === undefined) this.frame.rotation.set(0, 0, sample.yaw ?? 0);
  }
}

/** A box on four wheels, or a disc. */
class Cart implements Body {
  readonly group = new Group();
  readonly top: number;

  constructor(size: number, { look, headings }: Robot, wheels: boolean) {
    const [skin, dark, long] = [paint(look.colour), paint(DARK), Math.max(0.3, size)];
    const high = wheels ? 0.43 * long : 0.27;
    this.top = high + 0.35;
    if (wheels) {
      const places = [0.32, -0.32].flatMap((x) => [0.33, -0.33].map((y) => [x * long, y * long] as const));
      const round = new CylinderGeometry(0.17 * long, 0.17 * long, 0.1 * long, 14);
      this.group.add(box(long, 0.58 * long, 0.26 * long, skin, 0, 0, 0.3 * long), ...places.map(([x, y]) => solid(round, dark, x, y, 0.17 * long)));
    } else this.group.add(upright(long / 2, 0.25, skin, 0, 0, 0.14));
    // A light at the front shows where it faces.
    if (headings !== null) this.group.add(box(0.08 * long, 0.4 * long, 0.1, paint(GLASS), 0.48 * long, 0, high - 0.1));
  }

  pose({ x, y, z = 0, yaw = 0 }: Sample): void {
    this.group.position.set(x!, y!, Math.max(0, z - 0.14));
    this.group.rotation.z = yaw;
  }
}
