/** Import of an image as a map: its division into regions, chosen over the picture. */

import { useEffect, useRef, useState } from "preact/hooks";
import { notice } from "../panels/notice";
import { Dialog } from "./menus";

/** Send a file, or a division of one, to the studio, and show errors. */
export async function uploaded<T = null>(body: File | object, about: Record<string, string>): Promise<T | undefined> {
  const name = body instanceof File ? body.name : "division";
  const response = await fetch(`upload?${new URLSearchParams({ name, ...about })}`, {
    method: "POST",
    body: body instanceof File ? body : JSON.stringify(body),
  });
  if (response.ok) return (await response.json()) as T;
  notice(await response.text());
  return undefined;
}

/** Initial `side`, in pixels; `gray`: a byte for each pixel of the picture. */
interface Plan {
  width: number;
  height: number;
  picture: { width: number; height: number; gray: string };
  side: number;
  metres: number | null;
  labels: number;
  colours: string[];
}

interface Division {
  side: number;
  x: number;
  y: number;
  share: number;
  text: boolean;
  legend: Record<string, string>;
}

interface Preview {
  rows: number;
  cols: number;
  grid: string[];
  sealed: number[][];
  areas: Record<string, number[]>;
  notes: string[];
}

export function Import({ files, close }: { files: File[]; close(): void }) {
  const main = files.find((file) => /\.ya?ml$/i.test(file.name)) ?? files[0]!;
  const [plan, setPlan] = useState<Plan | null>(null);
  useEffect(() => {
    void (async () => {
      if (/\.map$/i.test(main.name)) {
        await uploaded(main, { kind: "map" });
        return close();
      }
      for (const other of files) if (other !== main) await uploaded(other, { kind: "companion" });
      const found = await uploaded<Plan>(main, { kind: "plan" });
      if (found) setPlan(found);
      else close();
    })();
  }, []);
  const picture = files.find((file) => /\.png$/i.test(file.name)) ?? null;
  return (
    <Dialog title={`Map from ${main.name}`} wide close={close}>
      {plan === null ? <p class="quiet">Reading the image …</p> : <Dividing plan={plan} file={picture} close={close} />}
    </Dialog>
  );
}

function Dividing({ plan, file, close }: { plan: Plan; file: File | null; close(): void }) {
  const [division, divide] = useState<Division>({ side: plan.side, x: 0, y: 0, share: 0, text: false, legend: {} });
  const [preview, setPreview] = useState<Preview | null>(null);
  const [wrong, setWrong] = useState("");
  const set = (change: Partial<Division>): void => divide({ ...division, ...change });
  useEffect(() => {
    let last = true;
    const timer = setTimeout(async () => {
      const response = await fetch("upload?kind=preview", { method: "POST", body: JSON.stringify(division) });
      if (!last) return;
      setWrong(response.ok ? "" : await response.text());
      setPreview(response.ok ? ((await response.json()) as Preview) : null);
    }, 100);
    return () => {
      last = false;
      clearTimeout(timer);
    };
  }, [division]);
  const slider = (key: "side" | "x" | "y", words: string, least: number, most: number) => (
    <label>
      <span>{words}</span>
      <input
        type="range"
        aria-label={words}
        min={least}
        max={most}
        value={division[key]}
        onInput={(event) => set({ [key]: Number(event.currentTarget.value) })}
      />
      <output>{division[key]} px</output>
    </label>
  );
  const create = async (): Promise<void> => {
    if ((await uploaded(division, { kind: "divided" })) !== undefined) close();
  };
  const rooms = preview?.sealed.length ?? 0;
  const sealed = preview?.sealed.reduce((sum, room) => sum + room.length, 0) ?? 0;
  return (
    <div class="dividing">
      <Picture plan={plan} file={file} division={division} preview={preview} />
      <div class="division">
        {slider("side", "side", 1, Math.max(2, Math.floor(Math.min(plan.width, plan.height) / 2)))}
        {slider("x", "origin x", 0, division.side)}
        {slider("y", "origin y", 0, division.side)}
        <label title="A region is a wall if this share of it is blocked">
          <span>share</span>
          <input
            type="range"
            aria-label="share"
            min={0}
            max={90}
            step={5}
            value={100 * division.share}
            onInput={(event) => set({ share: Number(event.currentTarget.value) / 100 })}
          />
          <output>{division.share === 0 ? "any" : `${Math.round(100 * division.share)} %`}</output>
        </label>
        {plan.labels > 0 && (
          <label class="check">
            <input type="checkbox" checked={division.text} onChange={(event) => set({ text: event.currentTarget.checked })} />
            <span>labels of the plan ({plan.labels}) are walls</span>
          </label>
        )}
        {plan.colours.length > 1 && <Legend colours={plan.colours} legend={division.legend} change={(legend) => set({ legend })} />}
        {preview && (
          <p class="divided">
            {preview.rows} x {preview.cols} regions{plan.metres && ` of ${+(division.side * plan.metres).toFixed(3)} m`}
          </p>
        )}
        {rooms > 0 && (
          <p class="sealed">
            {rooms} sealed room{rooms > 1 && "s"} ({sealed} region{sealed > 1 && "s"}), cut off from the largest. To open them, choose a smaller side, a
            larger share or another origin.
          </p>
        )}
        {preview?.notes.map((note) => (
          <p class="quiet" key={note}>
            {note}
          </p>
        ))}
        {wrong && <p class="sealed">{wrong}</p>}
        <div class="group">
          <button type="button" class="primary" onClick={() => void create()}>
            Create
          </button>
          <button type="button" onClick={close}>
            Cancel
          </button>
        </div>
      </div>
    </div>
  );
}

interface LegendProps {
  colours: string[];
  legend: Record<string, string>;
  change(legend: Record<string, string>): void;
}

/** Meanings of colours; without them, dark pixels are walls. */
function Legend({ colours, legend, change }: LegendProps) {
  const darkest = [...colours].sort((a, b) => light(a) - light(b))[0]!;
  const name = (colour: string, word: string): void => {
    const { [colour]: _, ...rest } = legend;
    const next = word === "" ? rest : { ...rest, [colour]: word };
    const walled = Object.values(next).includes("wall");
    change(Object.keys(next).length === 0 || walled || colour === darkest ? next : { ...next, [darkest]: "wall" });
  };
  return (
    <fieldset class="colours">
      <legend>Colours: wall, free, or the name of an area</legend>
      {colours.map((colour) => (
        <label key={colour}>
          <span class="swatch" style={{ background: colour }} />
          <input
            aria-label={`meaning of ${colour}`}
            list="meanings"
            placeholder={colour}
            value={legend[colour] ?? ""}
            onChange={(event) => name(colour, event.currentTarget.value.trim())}
          />
        </label>
      ))}
      <datalist id="meanings">
        <option value="wall" />
        <option value="free" />
      </datalist>
    </fieldset>
  );
}

function light(colour: string): number {
  return [1, 3, 5].reduce((sum, i) => sum + parseInt(colour.slice(i, i + 2), 16), 0);
}

interface PictureProps {
  plan: Plan;
  file: File | null;
  division: Division;
  preview: Preview | null;
}

/** The image with walls, sealed rooms and areas over it. */
function Picture({ plan, file, division, preview }: PictureProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [image, setImage] = useState<CanvasImageSource | null>(null);
  useEffect(() => {
    void createImageBitmap(file ?? grayOf(plan.picture)).then(setImage);
  }, []);
  const scale = Math.min(720 / plan.width, 540 / plan.height);
  useEffect(() => {
    const pen = canvas.current!.getContext("2d")!;
    pen.resetTransform();
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, canvas.current!.width, canvas.current!.height);
    pen.scale(scale, scale);
    if (image) pen.drawImage(image, 0, 0, plan.width, plan.height);
    if (preview === null) return;
    const { side, x, y } = division;
    const corner = (region: number): [number, number] => [
      x + (region % preview.cols) * side,
      y + Math.floor(region / preview.cols) * side,
    ];
    const fill = (regions: number[], colour: string): void => {
      pen.fillStyle = colour;
      for (const region of regions) pen.fillRect(...corner(region), side, side);
    };
    const walls = [...preview.grid.join("")].flatMap((cell, region) => (cell === "#" ? [region] : []));
    fill(walls, "rgb(0 60 140 / 45%)");
    for (const room of preview.sealed) fill(room, "rgb(230 90 0 / 60%)");
    pen.font = `600 ${13 / scale}px sans-serif`;
    for (const [name, regions] of Object.entries(preview.areas)) {
      fill(regions, "rgb(0 140 90 / 30%)");
      const [left, top] = corner(regions[0]!);
      pen.fillStyle = "#003d28";
      pen.fillText(name, left + 2 / scale, top + 14 / scale);
    }
    if (side * scale < 4) return;
    pen.strokeStyle = "rgb(0 60 140 / 35%)";
    pen.lineWidth = 1 / scale;
    pen.beginPath();
    for (let row = 0; row <= preview.rows; row++) pen.rect(x, y + row * side, preview.cols * side, 0);
    for (let col = 0; col <= preview.cols; col++) pen.rect(x + col * side, y, 0, preview.rows * side);
    pen.stroke();
  }, [image, preview]);
  return (
    <canvas
      ref={canvas}
      role="img"
      aria-label="The image with its walls, sealed rooms and areas"
      width={Math.round(plan.width * scale)}
      height={Math.round(plan.height * scale)}
    />
  );
}

function grayOf({ width, height, gray }: Plan["picture"]): ImageData {
  const data = new ImageData(width, height);
  const bytes = atob(gray);
  for (let i = 0; i < bytes.length; i++) {
    const byte = bytes.charCodeAt(i);
    data.data.set([byte, byte, byte, 255], 4 * i);
  }
  return data;
}
