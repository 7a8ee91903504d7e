/** Opening and saving: what to begin with, and what to take away. */

import { useState } from "preact/hooks";
import type { Say } from "../live/player";
import { linkOf, packedIn } from "./links";
import { RunDownloads } from "./live";
import type { Doc } from "./model";

export function OpenMenu({ templates, say, complain }: { templates: Record<string, string>; say: Say; complain(words: string): void }) {
  const [rows, setRows] = useState(7);
  const [cols, setCols] = useState(13);
  const send = async (files: FileList | null, kind: string): Promise<void> => {
    const all = [...(files ?? [])];
    const yaml = all.find((file) => /\.ya?ml$/i.test(file.name));
    const main = kind === "map" && yaml ? yaml : all[0];
    if (!main) return;
    const upload = async (file: File, what: string): Promise<void> => {
      const address = `upload?name=${encodeURIComponent(file.name)}&kind=${what}&rows=${rows}&cols=${cols}`;
      const plain = what === "map" && /\.map$/i.test(file.name);
      const response = await fetch(plain ? address.replace(/&rows.*$/, "") : address, { method: "POST", body: file });
      if (!response.ok) complain(await response.text());
    };
    for (const other of all) if (other !== main) await upload(other, "companion");
    await upload(main, kind);
  };
  const chosen = (input: HTMLInputElement, kind: string): void => {
    void send(input.files, kind);
    input.value = ""; // so that the same files can be chosen again, divided in another way
  };
  const link = (): void => {
    const given = prompt("A link, or what stands after its #");
    const found = given === null ? null : packedIn(given.includes("#") ? given : `#${given}`);
    if (found !== null) say("open", { kind: "link", packed: found });
    else if (given) complain("this link holds no scenario");
  };
  return (
    <details class="menu left">
      <summary>New</summary>
      <div onClick={(event) => (event.target as HTMLElement).tagName === "BUTTON" && (event.currentTarget.parentElement as HTMLDetailsElement).removeAttribute("open")}>
        <p>
          <input aria-label="Rows" type="number" min={3} max={512} value={rows} onInput={(e) => setRows(Number(e.currentTarget.value))} /> x{" "}
          <input aria-label="Columns" type="number" min={3} max={512} value={cols} onInput={(e) => setCols(Number(e.currentTarget.value))} />
        </p>
        <button type="button" onClick={() => say("open", { kind: "blank", rows, cols })}>
          Blank map of that size
        </button>
        {Object.entries(templates).map(([name, about]) => (
          <button type="button" key={name} title={about} onClick={() => say("open", { kind: "template", name })}>
            Template: {name}
          </button>
        ))}
        <label>
          Scenario file …
          <input type="file" hidden accept=".yaml,.yml" onChange={(e) => chosen(e.currentTarget, "scenario")} />
        </label>
        <label title="An image or a ROS map is divided into that many rows and columns; of a ROS map choose both files">
          Map: image, ROS, MovingAI …
          <input type="file" hidden multiple accept=".png,.pgm,.map,.yaml,.yml" onChange={(e) => chosen(e.currentTarget, "map")} />
        </label>
        <button type="button" onClick={link}>
          From a link …
        </button>
      </div>
    </details>
  );
}

export function SaveMenu({ doc, folder, ran, say, tell }: { doc: Doc; folder: boolean; ran: boolean; say: Say; tell(words: string): void }) {
  const share = async (): Promise<void> => {
    const fragment = await linkOf(doc.text);
    history.replaceState(null, "", fragment);
    try {
      await navigator.clipboard.writeText(location.href);
      tell("The link is copied. Its end, from # on, opens the scenario in any studio.");
    } catch {
      tell("The address now ends with the scenario: copy it from there.");
    }
  };
  const saveAs = (): void => {
    const name = prompt("A name in the folder", doc.file ?? "scenario.yaml");
    if (name) say("save", { name });
  };
  return (
    <details class="menu">
      <summary>Save{doc.dirty && <span class="dirty" title="There are changes that no file holds" />}</summary>
      <div>
        <button type="button" disabled={doc.file === null} onClick={() => say("save")}>
          Save {doc.file ?? "(no file was opened)"}
        </button>
        {folder && (
          <button type="button" onClick={saveAs}>
            Save as …
          </button>
        )}
        <a href="save/scenario" download>
          Download the scenario
        </a>
        <button type="button" onClick={() => void share()}>
          Copy a link
        </button>
        <a href="save/picture" download>
          Picture (SVG)
        </a>
        {ran && (
          <>
            <hr />
            <RunDownloads />
            <a href="save/played" download>
              Scenario as it was played
            </a>
            <button type="button" onClick={() => say("keep")}>
              Edit it as it was played
            </button>
          </>
        )}
      </div>
    </details>
  );
}
