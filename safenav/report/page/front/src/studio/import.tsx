/** A map from an image, a ROS map or a MovingAI map. */

import { useState } from "preact/hooks";
import { notice } from "../panels/notice";
import { Dialog } from "./menus";

/** Sends a file to the studio; what is wrong with it is shown. Returns whether it was taken. */
export async function uploaded(file: File, about: Record<string, string>): Promise<boolean> {
  const response = await fetch(`upload?${new URLSearchParams({ name: file.name, ...about })}`, { method: "POST", body: file });
  if (!response.ok) notice(await response.text());
  return response.ok;
}

export function Import({ files, close }: { files: File[]; close(): void }) {
  const [rows, setRows] = useState("");
  const [cols, setCols] = useState("");
  const main = files.find((file) => /\.ya?ml$/i.test(file.name)) ?? files[0]!;
  const create = async (): Promise<void> => {
    for (const other of files) if (other !== main) await uploaded(other, { kind: "companion" });
    const plain = /\.map$/i.test(main.name);
    if (await uploaded(main, { kind: "map", ...(!plain && { rows, cols }) })) close();
  };
  return (
    <Dialog title={`Map from ${main.name}`} close={close}>
      <form
        class="group"
        onSubmit={(event) => {
          event.preventDefault();
          void create();
        }}
      >
        <input aria-label="Rows of the map" placeholder="rows" inputMode="numeric" value={rows} onInput={(e) => setRows(e.currentTarget.value)} />
        <input aria-label="Columns of the map" placeholder="columns" inputMode="numeric" value={cols} onInput={(e) => setCols(e.currentTarget.value)} />
        <button class="primary">Create</button>
      </form>
      <form method="dialog">
        <button>Cancel</button>
      </form>
    </Dialog>
  );
}
