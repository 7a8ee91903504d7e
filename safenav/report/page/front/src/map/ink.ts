/** How things are drawn on the map and so in its legend: attributes of their shapes. The stylesheet has the colours. */

/** A line of the same width at every zoom. */
const LINE = { fill: "none", "vector-effect": "non-scaling-stroke" } as const;
/** A robot's colour, lighter on a dark page. */
const OWN = "color-mix(in oklab, var(--colour), light-dark(var(--colour), white) 40%)";
const [ACCENT, GROUND, FOUND] = ["var(--accent)", "var(--ground)", "var(--found)"];
const BOLD = { "font-weight": 700, "text-anchor": "middle" } as const;

export const INK = {
  ground: { fill: GROUND },
  lines: { fill: "none", stroke: "var(--grid)" },
  walls: { fill: "var(--wall)" },
  wallLine: { ...LINE, stroke: "var(--wall-line)" },
  areaLine: { ...LINE, stroke: ACCENT, "stroke-dasharray": "6 3", "stroke-width": 2 },
  exclusion: { ...LINE, stroke: "var(--synthesis)", "stroke-dasharray": "9 3 2 3", "stroke-width": 2.2 },
  charger: { fill: "var(--requested)" },
  numbers: { fill: "var(--number)" },
  names: { "stroke-linejoin": "round", "font-weight": 600, "paint-order": "stroke", "text-anchor": "middle", stroke: GROUND },
  // robots
  body: { stroke: "var(--outline)", "stroke-width": 0.1 },
  nose: { fill: "var(--outline)" },
  shape: { fill: "var(--ink)", "fill-rule": "evenodd" },
  plate: { fill: GROUND, stroke: "var(--ink)" },
  trail: { stroke: OWN, "stroke-linejoin": "round", "stroke-width": "var(--trail, 2.4px)" },
  trailPart: LINE,
  taken: { fill: "none", stroke: OWN, "stroke-width": 2 },
  refused: { fill: "none", stroke: FOUND, "stroke-width": 2.6 },
  // targets
  aim: { ...LINE, stroke: OWN, "stroke-linejoin": "round", "stroke-width": 2.4 },
  current: { fill: "color-mix(in oklab, var(--colour) 32%, transparent)" },
  avoided: { "stroke-dasharray": "2.4 4.8" },
  target: { stroke: "var(--outline)", "stroke-width": 0.24 },
  intention: { ...LINE, stroke: OWN, "stroke-dasharray": "2 5", "stroke-linecap": "round", "stroke-width": 2 },
  // sight and beliefs
  sight: { fill: "var(--colour)", "fill-opacity": 0.12 },
  sightEdge: { fill: "none", stroke: OWN, "stroke-opacity": 0.55, "stroke-width": 1.2 },
  hatch: { fill: OWN, "fill-opacity": 0.55 },
  belief: { fill: "var(--colour)", "fill-opacity": 0.13 },
  beliefEdge: { fill: "none", stroke: OWN, "stroke-dasharray": "5 3", "stroke-width": 1.6 },
  seenEdge: { fill: "none", stroke: OWN, "stroke-width": 2.6 },
  // what is pointed out
  pointed: { ...LINE, stroke: ACCENT, "stroke-width": 3 },
  spoken: { ...LINE, stroke: "var(--ink)", "stroke-width": 1.2 },
  cursor: { fill: "none", stroke: ACCENT, "stroke-dasharray": "4 2", "stroke-width": 3 },
  order: { ...BOLD, fill: "var(--ink)", "font-size": 16 },
  handle: { fill: "var(--panel)", stroke: ACCENT, "stroke-width": 2, cursor: "grab" },
  wrong: { fill: FOUND },
  wrongSign: { ...BOLD, fill: "#fff", "font-size": 11 },
} as const;

/** Marks of a hand in regions. */
export const MARKS = {
  hover: { fill: ACCENT, "fill-opacity": 0.18, stroke: ACCENT, "stroke-width": 2 },
  chosen: { fill: ACCENT, "fill-opacity": 0.3, stroke: ACCENT, "stroke-width": 2 },
  picked: { fill: "none", stroke: ACCENT, "stroke-width": 2.5 },
  wall: INK.walls,
  floor: { fill: GROUND, stroke: ACCENT },
  confined: { fill: "var(--resolved)", "fill-opacity": 0.14 },
  lost: { fill: FOUND, "fill-opacity": 0.28, stroke: FOUND, "stroke-width": 2 },
} as const;
