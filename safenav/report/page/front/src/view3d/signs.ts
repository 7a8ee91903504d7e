/** Words in the scene: labels that always face the reader, drawn on small canvases. */

import { CanvasTexture, Sprite, SpriteMaterial, SRGBColorSpace } from "three";

const PIXELS = 64;
/** Vertical angle of view of the camera in degrees, and the height of the picture at one metre. */
export const FIELD_ANGLE = 38;
const FIELD = 2 * Math.tan((FIELD_ANGLE * Math.PI) / 360);

export interface Style {
  ink: string;
  paper: string;
  /** Height as a part of the picture's height, whatever the distance. */
  height: number;
  /** The part of the sign at its position: 0 is its lower edge, 1 the upper one. */
  anchor?: number;
}

/** A sprite with a word on a rounded plate. */
export function sign(text: string, style: Style): Sprite {
  const canvas = document.createElement("canvas");
  const brush = canvas.getContext("2d")!;
  const font = `600 ${PIXELS * 0.62}px system-ui, "DejaVu Sans", sans-serif`;
  brush.font = font;
  const width = Math.ceil(brush.measureText(text).width + PIXELS * 0.6);
  canvas.width = width;
  canvas.height = PIXELS;
  brush.font = font;
  brush.fillStyle = style.paper;
  brush.beginPath();
  brush.roundRect(0, 0, width, PIXELS, PIXELS * 0.3);
  brush.fill();
  brush.fillStyle = style.ink;
  brush.textAlign = "center";
  brush.textBaseline = "middle";
  brush.fillText(text, width / 2, PIXELS * 0.54);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  const sprite = new Sprite(
    new SpriteMaterial({ map: texture, depthTest: false, transparent: true, sizeAttenuation: false }),
  );
  const height = style.height * FIELD;
  sprite.scale.set((height * width) / PIXELS, height, 1);
  sprite.center.set(0.5, style.anchor ?? 0.5);
  sprite.renderOrder = 10;
  return sprite;
}

/** A sign that may be empty, redrawn only when its text changes. */
export class Notice {
  private text = "";
  private sprite: Sprite | null = null;

  constructor(
    private readonly attach: (sprite: Sprite) => void,
    private readonly style: (text: string) => Style,
  ) {}

  show(text: string): void {
    if (text === this.text) return;
    this.text = text;
    if (this.sprite !== null) {
      this.sprite.material.map?.dispose();
      this.sprite.material.dispose();
      this.sprite.removeFromParent();
      this.sprite = null;
    }
    if (text === "") return;
    this.sprite = sign(text, this.style(text));
    this.attach(this.sprite);
  }
}
