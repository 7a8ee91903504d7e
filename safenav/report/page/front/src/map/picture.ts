/** Export of the shown map as a self-contained SVG, or as a PNG of twice the size. */

const KEPT = [
  "fill",
  "fill-opacity",
  "fill-rule",
  "font-family",
  "font-size",
  "font-weight",
  "opacity",
  "paint-order",
  "stroke",
  "stroke-dasharray",
  "stroke-linejoin",
  "stroke-opacity",
  "stroke-width",
  "text-anchor",
  "vector-effect",
];

/** The layers of the map as one SVG; styles become attributes, so that every program reads it. */
export function svgOfMap(map: HTMLElement): string {
  const { width, height } = map.getBoundingClientRect();
  const root = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  root.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  root.setAttribute("width", width.toFixed(0));
  root.setAttribute("height", height.toFixed(0));
  const paper = document.createElementNS(root.namespaceURI, "rect");
  paper.setAttribute("width", "100%");
  paper.setAttribute("height", "100%");
  paper.setAttribute("fill", plain(getComputedStyle(document.body).backgroundColor));
  root.append(paper);
  for (const layer of map.querySelectorAll("svg")) {
    const copy = layer.cloneNode(true) as SVGSVGElement;
    dress(layer, copy);
    copy.setAttribute("width", width.toFixed(0));
    copy.setAttribute("height", height.toFixed(0));
    root.append(copy);
  }
  return new XMLSerializer().serializeToString(root);
}

function dress(shown: Element, copy: Element): void {
  const style = getComputedStyle(shown);
  for (const name of KEPT) {
    const value = style.getPropertyValue(name);
    if (value) copy.setAttribute(name, name === "fill" || name === "stroke" ? plain(value) : value);
  }
  copy.removeAttribute("style");
  [...shown.children].forEach((child, i) => dress(child, copy.children[i]!));
}

const canvas = document.createElement("canvas");
canvas.width = canvas.height = 1;
const known = new Map<string, string>();

/** A colour in the notation that every program knows. */
function plain(colour: string): string {
  if (colour === "none" || colour.startsWith("url(")) return colour;
  let found = known.get(colour);
  if (found === undefined) {
    const context = canvas.getContext("2d", { willReadFrequently: true })!;
    context.clearRect(0, 0, 1, 1);
    context.fillStyle = colour;
    context.fillRect(0, 0, 1, 1);
    const [red, green, blue, alpha] = context.getImageData(0, 0, 1, 1).data;
    found = alpha === 0 ? "none" : `rgb(${red},${green},${blue})`;
    known.set(colour, found);
  }
  return found;
}

export function saveSvg(map: HTMLElement, name: string): void {
  save(new Blob([svgOfMap(map)], { type: "image/svg+xml" }), `${name}.svg`);
}

export async function savePng(map: HTMLElement, name: string): Promise<void> {
  const { width, height } = map.getBoundingClientRect();
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svgOfMap(map))}`;
  await image.decode();
  const page = document.createElement("canvas");
  page.width = 2 * width;
  page.height = 2 * height;
  page.getContext("2d")!.drawImage(image, 0, 0, page.width, page.height);
  page.toBlob((blob) => blob && save(blob, `${name}.png`));
}

function save(blob: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
